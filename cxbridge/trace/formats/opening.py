"""Files that are written by one process at a time."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import BinaryIO

from cxbridge.errors import TraceError


def open_alone(path: Path, buffering: int = -1) -> BinaryIO:
    """Open a file for writing, empty, unless another process writes it in this way.

    Where there are no locks (Windows, some network file systems), and what is no file, is opened as usual.

    :raises TraceError: when somebody else writes it; it stays as it is.
    :raises OSError: when it cannot be opened.
    """
    if sys.platform == "win32":
        return path.open("wb", buffering)
    try:
        import fcntl  # noqa: PLC0415 - not every system has it
    except ImportError:
        return path.open("wb", buffering)
    if path.exists() and not path.is_file():
        return path.open("wb", buffering)
    file = open(path, "wb", buffering, opener=_open_as_it_is)  # noqa: SIM115 - an opener
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise TraceError(
            "another process is writing this file",
            file=path,
            hint="does another daemon or run record into it?",
        ) from None
    except OSError:
        pass  # a file system without locks
    try:
        file.truncate(0)
    except OSError:
        file.close()
        raise
    return file


def keep_previous(path: Path) -> Path | None:
    """Give a file that is about to be replaced another name: the time of its last change is added to it.

    What is empty, no file, or being written by another process stays; so does the target of a link.

    :return: the new name; None: nothing was renamed.
    :raises TraceError: when it cannot be renamed.
    """
    if path.is_symlink() or not path.is_file() or not path.stat().st_size or _is_locked(path):
        return None
    stem = f"{path.stem}-{time.strftime('%Y-%m-%d-%H-%M-%S', time.localtime(path.stat().st_mtime))}"
    names = (f"{stem}{again}{path.suffix}" for again in ("", *(f"-{count}" for count in range(2, 10_000))))
    kept = next(other for name in names if not (other := path.with_name(name)).exists())
    try:
        return path.rename(kept)
    except OSError as error:
        raise TraceError(f"cannot keep it as {kept.name}: {error.strerror}", file=path) from error


def _is_locked(path: Path) -> bool:
    if sys.platform == "win32":
        return False
    try:
        import fcntl  # noqa: PLC0415 - not every system has it

        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (ImportError, OSError):
        return False
    return False


def _open_as_it_is(path: str, flags: int) -> int:
    return os.open(path, flags & ~os.O_TRUNC, 0o666)
