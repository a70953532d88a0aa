"""Processes that the tests start end with the tests, however the tests end.

A killed test (a worker out of memory, a job that takes too long) does not end its daemons. So a small process
watches the process of the tests. After its end the watcher kills the processes with its mark in the
environment, which every child inherits: daemons, planners, browsers. Linux only.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

VARIABLE = "CXBRIDGE_TESTS"
GRACE_S = 2
"""Seconds that children of a process which ended in order have to end too."""
PATIENCE_S = 60
"""Seconds after which nothing more can be done."""


def watch() -> None:
    """Mark this process' children, and have them killed after its end."""
    if sys.platform != "linux":
        return
    mark = f"{os.getpid()}-{time.time_ns()}"
    os.posix_spawn(
        sys.executable,
        [sys.executable, "-I", "-S", __file__, str(os.getpid()), mark],
        {name: value for name, value in os.environ.items() if name != VARIABLE},
        file_actions=[(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in range(3)],
        setsid=True,  # signals to the group of the tests are not for the watcher
    )
    os.environ[VARIABLE] = mark


def _kill(mark: str, number: int) -> bool:
    """Send a signal to the processes with the mark; return whether any exist."""
    found = False
    wanted = f"{VARIABLE}={mark}".encode()
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            process = os.pidfd_open(int(place.name))  # the number may be another's before the signal
            try:
                if wanted in (place / "environ").read_bytes().split(b"\0"):
                    signal.pidfd_send_signal(process, number)
                    found = True
            finally:
                os.close(process)
    return found


def main(process: int, mark: str) -> None:
    """Wait for the end of a process, and kill its children."""
    with suppress(ProcessLookupError):
        poll = select.poll()
        poll.register(os.pidfd_open(process), select.POLLIN)
        poll.poll()
    for time_s in range(PATIENCE_S):
        if not _kill(mark, signal.SIGKILL if time_s >= GRACE_S else 0):
            break
        time.sleep(1)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
