"""Checks whether files can be read, and atomic output files."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

ABSENT: Final = "is not there"
"""The reason if nothing exists at a path."""

_NOTHING_THERE: Final = frozenset({errno.ENOENT, errno.ENOTDIR, errno.ELOOP})


@contextmanager
def file_errors() -> Iterator[None]:
    """Raise an error with the file instead of an OSError.

    It is for processes that send their errors to another process; the command line handles an OSError in the
    same way.

    :raises CxbridgeError: instead of an OSError with a file.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            raise
        raise CxbridgeError(error.strerror or str(error), file=error.filename) from error


def is_readable_file(path: str | Path) -> bool:
    """Return whether a path is a readable regular file; opening a pipe might block forever."""
    return not why_unreadable(path)


def why_unreadable(path: str | Path) -> str:
    """Return why a path is not a readable file, as a phrase after its name; empty if it is.

    A parent folder that must not be searched is a reason, because its content is unknown.
    """
    path = Path(path)
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return "is not a regular file"
        path.open("rb").close()
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) not in _NOTHING_THERE:
            return f"cannot be read: {getattr(error, 'strerror', None) or error}"
        return f"is a link to {path.readlink()}, which leads to no file" if path.is_symlink() else ABSENT
    return ""


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a path for writing a file or folder that finally replaces ``path``.

    After an error, the new file is removed and ``path`` is unchanged. The yielded path has the same name. An
    existing file or folder is initially an empty file or folder; new files go into the old folder. Devices
    and pipes are written directly, as are files in folders that allow no new files.

    :raises CxbridgeError: instead of an OSError of this file; errors of the block name ``path``.
    """
    path = Path(path)
    real = path
    try:
        real = Path(os.path.realpath(path))
        folder = _temporary_folder(real)
        if folder is None:
            yield path
            return
        fresh = folder / real.name
        try:
            _make_like(fresh, real)
            yield fresh
            _put_in_place(fresh, real)
        except (CxbridgeError, OSError) as error:
            _rename_in(error, fresh, path)
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        if error.filename is not None and Path(error.filename) not in (path, real):
            raise
        raise CxbridgeError(f"cannot be written: {error.strerror}", file=path) from error


def write_file(path: str | Path, content: str | bytes) -> None:
    r"""Write a whole file; after an error the old file is unchanged.

    :param content: a text is written in UTF-8 with line ends ``\n``.
    :raises CxbridgeError: if the file cannot be written.
    """
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with replacing(path) as fresh:
        fresh.write_bytes(data)


def _temporary_folder(real: Path) -> Path | None:
    """Create a temporary folder next to a file or within a folder; None to write directly."""
    if real.exists() and not real.is_file() and not real.is_dir():
        return None
    try:
        return Path(tempfile.mkdtemp(prefix=".cxbridge-", dir=real if real.is_dir() else real.parent))
    except OSError as error:
        if real.is_file():  # the folder takes no new files, but the file itself may be writable
            return None
        raise OSError(error.errno, error.strerror, str(real)) from error


def _make_like(fresh: Path, real: Path) -> None:
    """Create an empty file or folder of the same kind as the existing one, if any."""
    if real.is_dir():
        fresh.mkdir()
    elif real.exists():
        fresh.touch()
        # writable even if the old file is not, because the new content must be written
        fresh.chmod(stat.S_IMODE(real.stat().st_mode) | stat.S_IWUSR)


def _put_in_place(fresh: Path, real: Path) -> None:
    """Move a file or folder to its final place."""
    if real.is_dir():
        for file in sorted(fresh.iterdir()):
            file.replace(real / file.name)
    else:
        fresh.replace(real)


def _rename_in(error: CxbridgeError | OSError, fresh: Path, path: Path) -> None:
    """Make an error name the path that the user has given."""
    file = error.filename if isinstance(error, OSError) else error.file
    if file is None or not Path(file).is_relative_to(fresh):
        return
    user_file = str(path / Path(file).relative_to(fresh))
    if isinstance(error, OSError):
        error.filename = user_file
    else:
        error.file, error.message = user_file, error.message.replace(str(fresh), str(path))
        error.args = (error.message,)


def walk(root: Path) -> Iterator[tuple[str, list[str], list[str]]]:
    """Walk through folders like :func:`os.walk`, following links, but visiting each folder once."""
    visited: set[str] = set()
    for folder, subfolders, files in os.walk(root, followlinks=True):
        real = os.path.realpath(folder)
        if real in visited:
            subfolders.clear()  # os.walk then does not enter them
        else:
            visited.add(real)
            yield folder, subfolders, files
