"""The processes of an exploration's session."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path


def session_members(leader: int) -> Iterator[int]:
    """Yield the descendants of a process, which are the further processes of its session."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            fields = (folder / "stat").read_bytes().rpartition(b")")[2].split()
            if int(fields[3]) == leader != int(folder.name) and fields[0] != b"Z":
                yield int(folder.name)


def assert_ended(leader: int, within_s: float = 20.0) -> None:
    """Check that the descendants of a process end; a killed process needs time on a loaded machine."""
    deadline = time.monotonic() + within_s
    while members := list(session_members(leader)):
        assert time.monotonic() < deadline, f"still running: {members}"
        time.sleep(0.02)
