"""Opens the files of recorded runs: lines of text in bounded memory, one writer at a time, clear errors."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from cxbridge.errors import TraceError

MAX_LINE = 4 * 1024 * 1024
"""Longest line, and longest entry of several lines, in bytes: far above any fact, far below any memory."""


def files_starting(folder: Path, pattern: str, size: int, starts_well: Callable[[bytes], bool]) -> list[Path]:
    """Return the files in a folder that begin as those of a format do, by name; none when it is not a folder.

    :param pattern: of their names.
    :param size: how many bytes ``starts_well`` needs to see.
    """
    found = []
    for path in sorted(folder.glob(pattern)) if folder.is_dir() else ():
        with suppress(OSError):
            if path.is_file():
                with path.open("rb") as file:
                    if starts_well(file.read(size)):
                        found.append(path)
    return found


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into one that says that the file cannot be read.

    :raises TraceError: instead of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise TraceError(f"cannot be read: {error.strerror}", file=path) from error


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into one that says that the file cannot be written.

    :raises TraceError: instead of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise TraceError(f"cannot be written: {error.strerror}", file=path) from error


def read_lines(path: Path) -> Iterator[tuple[int, str, bool]]:
    r"""Yield ``(number, text, whole)`` for each line; ``whole`` is False for a last line without its end.

    Only line feeds end lines. Bytes that are not UTF-8 appear as ``\xNN``.

    :raises TraceError: when the file cannot be read, or a line is longer than :data:`MAX_LINE`.
    """
    number = 0
    with reading(path), path.open("rb") as file:
        while line := file.readline(MAX_LINE + 1):
            number += 1
            if len(line) > MAX_LINE:
                raise TraceError(
                    f"a line of more than {MAX_LINE >> 20} MiB",
                    file=path,
                    line=number,
                    hint="this is not a text log of a run, or it is damaged here",
                )
            whole = line.endswith(b"\n")
            yield number, (line[:-1] if whole else line).decode("utf-8", "backslashreplace"), whole


def open_alone(path: Path, buffering: int = -1) -> BinaryIO:
    """Open a file for writing, empty, unless another process writes it in this way.

    Without locks (Windows, some network file systems), and for anything but a file, the path is opened as
    usual.

    :raises TraceError: when another process writes it; the file is unchanged then.
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
        raise _locked(path) from None
    except OSError:
        pass  # a file system without locks
    try:
        file.truncate(0)
    except OSError:
        file.close()
        raise
    return file


def refuse_locked(path: Path) -> None:
    """Refuse a file that another process has opened by :func:`open_alone`.

    :raises TraceError: when it has.
    """
    if path.is_file() and _is_locked(path):
        raise _locked(path)


def _locked(path: Path) -> TraceError:
    return TraceError(
        "another process is writing this file", file=path, hint="does another daemon or run record into it?"
    )


def keep_previous(path: Path) -> Path | None:
    """Give a file that is about to be replaced another name: the time of its last change is added to it.

    Empty files, other things than files, and files of another writing process stay; so does the target of a
    link.

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
