"""Files of recorded runs: lines in bounded memory, exclusive writing, errors that name the file."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import BinaryIO

from cxbridge.errors import TraceError

# far above the size of any fact, far below the memory of any machine
MAX_LINE_BYTES = 4 * 1024 * 1024
"""The maximum number of bytes of a line, or of an entry of several lines."""


def reading(path: Path) -> AbstractContextManager[None]:
    """Convert an OSError of the block, which reads a file, to an error with the file.

    :raises TraceError: instead of an OSError.
    """
    return _translating_errors(path, "read")


def writing(path: Path) -> AbstractContextManager[None]:
    """Convert an OSError of the block, which writes a file, to an error with the file.

    :raises TraceError: instead of an OSError.
    """
    return _translating_errors(path, "written")


@contextmanager
def _translating_errors(path: Path, participle: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise TraceError(f"cannot be {participle}: {error.strerror}", file=path) from error


def read_lines(path: Path) -> Iterator[tuple[int, str, bool]]:
    r"""Yield ``(number, text, is_complete)`` per line; a last line without line feed is incomplete.

    Only line feeds end lines. Bytes that are not UTF-8 become ``\xNN``.

    :raises TraceError: if the file cannot be read, or a line is longer than :data:`MAX_LINE_BYTES`.
    """
    number = 0
    with reading(path), path.open("rb") as file:
        while line := file.readline(MAX_LINE_BYTES + 1):
            number += 1
            if len(line) > MAX_LINE_BYTES:
                raise TraceError(
                    f"the line has more than {MAX_LINE_BYTES >> 20} MiB",
                    file=path,
                    line=number,
                    hint="this is not a text log of a run, or it is damaged here",
                )
            is_complete = line.endswith(b"\n")
            yield (
                number,
                (line[:-1] if is_complete else line).decode("utf-8", "backslashreplace"),
                is_complete,
            )


def open_exclusively(path: Path, buffering: int = -1) -> BinaryIO:
    """Open an empty file for writing, unless another process has opened the file by this function.

    Without locks, and for paths other than regular files, the file is opened normally.

    :raises TraceError: if another process writes the file, which is then unchanged.
    :raises OSError: if the file cannot be opened.
    """
    if path.exists() and not path.is_file():  # a device or pipe cannot be truncated
        return path.open("wb", buffering)
    # truncate only under the lock: another process may be writing the file
    file = open(path, "wb", buffering, opener=_open_without_truncating)  # noqa: SIM115 - an opener
    if not _try_to_lock(file):
        file.close()
        raise _make_locked_error(path)
    file.truncate(0)
    return file


def _try_to_lock(file: BinaryIO, *, is_shared: bool = False) -> bool:
    """Lock a file until it is closed; return False if another process has locked the file.

    Without locks (Windows, some network file systems), nothing is locked, and the result is True.

    :param is_shared: whether other processes may hold a shared lock at the same time.
    """
    if sys.platform == "win32":
        return True
    import fcntl  # noqa: PLC0415 - Windows has no such module

    try:
        fcntl.flock(file, (fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def refuse_locked_file(path: Path) -> None:
    """Raise `TraceError` if another process has opened a file by :func:`open_exclusively`.

    :raises TraceError: if the file is locked.
    """
    if path.is_file() and _is_locked(path):
        raise _make_locked_error(path)


def _make_locked_error(path: Path) -> TraceError:
    return TraceError(
        "another process is writing this file", file=path, hint="does another daemon or run record to it?"
    )


def rename_previous(path: Path) -> Path | None:
    """Rename a file that is about to be replaced, with the time of its last change in the name.

    Empty files, paths other than regular files, links, and files that another process writes are not renamed.

    :returns: the new path; None if the file is not renamed.
    :raises TraceError: if the file cannot be renamed.
    """
    if path.is_symlink() or not path.is_file() or not path.stat().st_size or _is_locked(path):
        return None
    stem = f"{path.stem}-{time.strftime('%Y-%m-%d-%H-%M-%S', time.localtime(path.stat().st_mtime))}"
    names = (f"{stem}{suffix}{path.suffix}" for suffix in ("", *(f"-{count}" for count in range(2, 10_000))))
    free_path = next(candidate for name in names if not (candidate := path.with_name(name)).exists())
    try:
        return path.rename(free_path)
    except OSError as error:
        raise TraceError(
            f"the file cannot be renamed to {free_path.name}: {error.strerror}", file=path
        ) from error


def _is_locked(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            # several processes may examine a file at once; only a writer's lock is exclusive
            return not _try_to_lock(file, is_shared=True)
    except OSError:  # a file that cannot be opened: writing it will raise the error
        return False


def _open_without_truncating(path: str, flags: int) -> int:
    # Python's permissions of new files, before the umask
    return os.open(path, flags & ~os.O_TRUNC, 0o666)
