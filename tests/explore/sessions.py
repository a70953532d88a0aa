"""The processes of an exploration, found by their session."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path


def others_of_session(leader: int) -> Iterator[int]:
    """Yield the processes that a process has started, and those that they have started."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            fields = (folder / "stat").read_bytes().rpartition(b")")[2].split()
            if int(fields[3]) == leader != int(folder.name) and fields[0] != b"Z":
                yield int(folder.name)
