"""Folders with a file for each interface."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path


def files_with_start(
    folder: Path, pattern: str, size: int, starts_well: Callable[[bytes], bool]
) -> list[Path]:
    """Return the files in a folder that start as the files of a format, by name; empty if there is no folder.

    :param size: the number of bytes that ``starts_well`` needs.
    :param starts_well: returns whether these first bytes are those of the format.
    """
    files = []
    for path in sorted(folder.glob(pattern)) if folder.is_dir() else ():
        with suppress(OSError):  # an unreadable file is not part of the recording
            if path.is_file():
                with path.open("rb") as file:
                    if starts_well(file.read(size)):
                        files.append(path)
    return files
