"""Processes that copy themselves. Windows has none of this: ask :data:`HAS_FORK` first."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Final, Protocol

HAS_FORK: Final = hasattr(os, "fork")


class Stoppable(Protocol):
    """A thread of a process that forks: it stops during the fork, and continues in both processes."""

    def start(self) -> None:
        """Begin, in the thread that copies the process."""

    def stop(self) -> None:
        """End, and wait for that."""


threads: Final[list[Stoppable]] = []
"""The threads there are that :func:`fork` may stop."""


class NoForkError(NotImplementedError):
    """The system cannot copy processes: a caller did not ask :data:`HAS_FORK`."""


def fork() -> int:
    """Copy this process, which may have no other thread than those of :data:`threads`.

    :returns: the copy's number; 0 in the copy.
    :raises OSError: when the system has no room for it.
    """
    if sys.platform == "win32":
        raise NoForkError
    paused = [*threads]
    for thread in paused:
        thread.stop()
    try:
        return os.fork()
    finally:
        for thread in paused:
            thread.start()


def has_ended(child: int) -> bool:
    """Return whether a child has ended, without waiting; the system forgets it then."""
    if sys.platform == "win32":
        raise NoForkError
    return os.waitpid(child, os.WNOHANG) != (0, 0)


def kill(pid: int) -> None:
    """End a process at once: kill -9.

    :raises ProcessLookupError: when it is gone.
    """
    if sys.platform == "win32":
        raise NoForkError
    os.kill(pid, signal.SIGKILL)


def local_socket() -> socket.socket:
    """Return a stream socket whose address is a path."""
    if sys.platform == "win32":
        raise NoForkError
    return socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)


def let_signals_end() -> None:
    """Restore the default handlers of the signals that end a process; ignore SIGINT."""
    if sys.platform == "win32":
        raise NoForkError
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def cpu_seconds(pid: int) -> float:
    """Return how much processor time a process has used; where the system does not tell, the time of day."""
    if sys.platform == "win32":
        raise NoForkError
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return time.monotonic()
    ticks: int = os.sysconf("SC_CLK_TCK")
    return (int(fields[11]) + int(fields[12])) / ticks


def limit_cpu_seconds(seconds: int | None) -> None:
    """Have the system end this process after this processor time; None: never."""
    if sys.platform == "win32":
        raise NoForkError
    import resource  # noqa: PLC0415 - not every system has it

    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (hard if seconds is None else seconds, hard))
