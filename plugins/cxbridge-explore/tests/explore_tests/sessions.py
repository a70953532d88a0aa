"""The processes of an exploration, found by their session."""

from __future__ import annotations

import time
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


def assert_ended(leader: int, within_s: float = 20.0) -> None:
    """Check that all other processes of a session end. A killed process needs a moment on a busy machine."""
    until = time.monotonic() + within_s
    while left := list(others_of_session(leader)):
        assert time.monotonic() < until, f"still there: {left}"
        time.sleep(0.02)
