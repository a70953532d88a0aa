"""Checks of input files, output files that replace old files when complete, and a walk through folders."""

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

ABSENT: Final = "does not exist"
"""The phrase of :func:`why_unreadable` for a path at which nothing exists."""

# The errors of a missing file, of a file in place of a folder, and of a link that leads to itself.
_ABSENCE_ERRNOS: Final = frozenset({errno.ENOENT, errno.ENOTDIR, errno.ELOOP})


@contextmanager
def file_errors() -> Iterator[None]:
    """Convert an OSError of the block to an error with the file.

    For processes that send their errors to another process; the command line converts an OSError likewise.

    :raises CxbridgeError: instead of an OSError with a file.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            raise
        raise CxbridgeError(error.strerror or str(error), file=error.filename) from error


def is_readable_file(path: str | Path) -> bool:
    """Return whether a path is a readable regular file, so that opening it cannot block as a pipe can."""
    return not why_unreadable(path)


def why_unreadable(path: str | Path) -> str:
    """Return why a path is not a readable file, as a phrase to follow the path; empty for a readable file.

    A parent folder without permission to search is a reason, too, because its content is unknown.
    """
    try:
        # pathlib would take three times as long, and a run checks a hundred paths
        if not stat.S_ISREG(os.stat(path).st_mode):  # noqa: PTH116
            return "is not a regular file"
        os.close(os.open(path, os.O_RDONLY))
    except (OSError, ValueError) as error:  # ValueError: the path has a null byte
        if getattr(error, "errno", None) not in _ABSENCE_ERRNOS:
            return f"cannot be read: {getattr(error, 'strerror', None) or error}"
        return f"is a broken link to {Path(path).readlink()}" if Path(path).is_symlink() else ABSENT
    return ""


@contextmanager
def replaced_file(path: str | Path) -> Iterator[Path]:
    """Yield a path for a new file or folder, which replaces ``path`` at the end of the block.

    The folder of ``path`` is made if there is none. The yielded path has the name of ``path``, or of the
    target if ``path`` is a link. If ``path`` exists, the yielded path exists, too, but is empty. After an
    error in the block, the new file is removed and ``path`` is unchanged. The new files of a folder are moved
    into the old folder.

    Devices and pipes, and files in folders that allow no new files, are written directly: ``path`` itself is
    yielded.

    :raises CxbridgeError: instead of an OSError about this file. Errors of the block about the yielded path
        name ``path``.
    """
    path = make_parent_folder(Path(path))
    target = path
    try:
        target = Path(os.path.realpath(path))
        folder = _make_temporary_folder(target)
        if folder is None:
            yield path
            return
        new_path = folder / target.name
        try:
            _create_like(new_path, target)
            yield new_path
            _move_to_target(new_path, target)
        except (CxbridgeError, OSError) as error:
            _restore_path_in_error(error, new_path, path)
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        if error.filename is not None and Path(error.filename) not in (path, target):
            raise
        raise CxbridgeError(f"cannot be written: {error.strerror}", file=path) from error


def make_parent_folder(file: Path) -> Path:
    """Make the folder of an output file if there is none; return the file.

    :raises CxbridgeError: if the folder cannot be made.
    """
    try:
        if not file.parent.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CxbridgeError(
            f"cannot be written: its folder cannot be made: {error.strerror}", file=file
        ) from error
    return file


def write_file(path: str | Path, content: str | bytes) -> None:
    """Write a whole file as in :func:`replaced_file`: after an error, the old file is unchanged.

    :param content: a text is written in UTF-8 with its own line ends; lone surrogates are escaped.
    :raises CxbridgeError: if the file cannot be written.
    """
    encoded = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with replaced_file(path) as new_path:
        new_path.write_bytes(encoded)


def _make_temporary_folder(target: Path) -> Path | None:
    """Create a temporary folder next to a file or within a folder; None to write directly."""
    if target.exists() and not target.is_file() and not target.is_dir():
        return None
    try:
        return Path(tempfile.mkdtemp(prefix=".cxbridge-", dir=target if target.is_dir() else target.parent))
    except OSError as error:
        if target.is_file():  # the folder takes no new files, but the file itself may be writable
            return None
        raise OSError(error.errno, error.strerror, str(target)) from error


def _create_like(new_path: Path, target: Path) -> None:
    """Create an empty file or folder of the same kind as an existing target."""
    if target.is_dir():
        new_path.mkdir()
    elif target.exists():
        new_path.touch()
        # writable even if the old file is not, because the new content must be written
        new_path.chmod(stat.S_IMODE(target.stat().st_mode) | stat.S_IWUSR)


def _move_to_target(new_path: Path, target: Path) -> None:
    """Move the new file, or the files of the new folder, to their final place."""
    if target.is_dir():
        for file in sorted(new_path.iterdir()):
            file.replace(target / file.name)
    else:
        new_path.replace(target)


def _restore_path_in_error(error: CxbridgeError | OSError, new_path: Path, path: Path) -> None:
    """Replace the temporary path in an error by the path that the user has given."""
    file = error.filename if isinstance(error, OSError) else error.file
    if file is None or not Path(file).is_relative_to(new_path):
        return
    user_file = str(path / Path(file).relative_to(new_path))
    if isinstance(error, OSError):
        error.filename = user_file
    else:
        error.file, error.message = user_file, error.message.replace(str(new_path), str(path))
        error.args = (error.message,)  # the arguments for unpickling


def walk_folders(root: Path) -> Iterator[tuple[str, list[str], list[str]]]:
    """Walk through folders like :func:`os.walk`, following links, but visiting each folder once."""
    visited: set[str] = set()
    for folder, subfolders, files in os.walk(root, followlinks=True):
        resolved = os.path.realpath(folder)
        if resolved in visited:
            subfolders.clear()  # os.walk then does not enter them
        else:
            visited.add(resolved)
            yield folder, subfolders, files
