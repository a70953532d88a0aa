"""Functions for processes that fork, and for their copies.

Windows cannot fork: callers check :data:`HAS_FORK` first.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Final

from cxbridge.run import watchdog

HAS_FORK: Final = hasattr(os, "fork")


class NoForkError(NotImplementedError):
    """The system cannot fork."""


def fork() -> int:
    """Fork this process, which may have no threads except :data:`cxbridge.run.watchdog.running_watchdogs`.

    :returns: the process id of the child; 0 in the child.
    :raises OSError: if the system lacks resources.
    """
    if sys.platform == "win32":
        raise NoForkError
    # A copy has only the forking thread; locks that other threads hold would stay locked in it.
    paused = [*watchdog.running_watchdogs]
    for thread in paused:
        thread.stop()
    try:
        return os.fork()
    finally:
        for thread in paused:
            thread.start()


def has_ended(child: int) -> bool:
    """Return whether a child has ended, without waiting. The system then forgets the child."""
    if sys.platform == "win32":
        raise NoForkError
    return os.waitpid(child, os.WNOHANG) != (0, 0)


def kill(pid: int) -> None:
    """End a process at once (kill -9).

    :raises ProcessLookupError: if the process has ended.
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
    """Let SIGTERM and SIGHUP end this process, whatever handlers it inherits, and ignore SIGINT."""
    if sys.platform == "win32":
        raise NoForkError
    signal.set_wakeup_fd(-1)  # the descriptor is shared with the parent, whose handler would wake up
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def cpu_seconds(pid: int) -> float:
    """Return the CPU seconds of a process; without procfs, the monotonic time."""
    if sys.platform == "win32":
        raise NoForkError
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return time.monotonic()
    ticks: int = os.sysconf("SC_CLK_TCK")
    return (int(fields[11]) + int(fields[12])) / ticks  # utime and stime of proc(5)


def limit_cpu_seconds(seconds: int | None) -> None:
    """Let the system end this process after some CPU seconds; None removes the limit."""
    if sys.platform == "win32":
        raise NoForkError
    import resource  # noqa: PLC0415 - Windows lacks the module

    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (hard if seconds is None else seconds, hard))
