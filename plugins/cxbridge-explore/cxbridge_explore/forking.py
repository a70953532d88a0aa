"""Functions for processes that fork, and for their forked copies.

Windows cannot fork, so callers check :data:`HAS_FORK` first. Each function raises `NoForkError` on Windows,
by a test of ``sys.platform``: a type checker then skips the rest of the function, whose calls Windows lacks.
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
    # A copy has only the forking thread, and locks that other threads hold would stay locked in the copy.
    paused_threads = [*watchdog.running_watchdogs]
    for thread in paused_threads:
        thread.stop()
    try:
        return os.fork()
    finally:
        for thread in paused_threads:
            thread.start()


def has_ended(child_pid: int) -> bool:
    """Return whether a child has ended, without waiting. If it has ended, the system forgets the child."""
    if sys.platform == "win32":
        raise NoForkError
    return os.waitpid(child_pid, os.WNOHANG) != (0, 0)


def kill(pid: int) -> None:
    """End a process at once (kill -9).

    :raises ProcessLookupError: if the process has ended.
    """
    if sys.platform == "win32":
        raise NoForkError
    os.kill(pid, signal.SIGKILL)


def make_local_socket() -> socket.socket:
    """Make a stream socket whose address is a path."""
    if sys.platform == "win32":
        raise NoForkError
    return socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)


def reset_signals() -> None:
    """Let SIGTERM and SIGHUP end this process in place of inherited handlers, and ignore SIGINT."""
    if sys.platform == "win32":
        raise NoForkError
    # the parent shares the inherited descriptor, and would handle the signals of this process
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def read_cpu_seconds(pid: int) -> float:
    """Return the processor time of a process. On systems without /proc, return the monotonic time instead."""
    if sys.platform == "win32":
        raise NoForkError
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return time.monotonic()
    ticks: int = os.sysconf("SC_CLK_TCK")
    return (int(fields[11]) + int(fields[12])) / ticks  # utime and stime of proc(5)


def limit_cpu_seconds(seconds: int | None) -> None:
    """Let the system end this process after some seconds of processor time; None removes the limit."""
    if sys.platform == "win32":
        raise NoForkError
    import resource  # noqa: PLC0415 - Windows lacks the module

    _, hard_limit = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (hard_limit if seconds is None else seconds, hard_limit))
