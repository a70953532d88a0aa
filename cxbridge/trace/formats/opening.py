"""Files that are written by one process at a time."""

from __future__ import annotations

import os
import sys
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


def _open_as_it_is(path: str, flags: int) -> int:
    return os.open(path, flags & ~os.O_TRUNC, 0o666)
