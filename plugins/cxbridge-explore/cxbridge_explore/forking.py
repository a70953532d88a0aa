"""Functions for processes that fork, and for their forked copies.

Windows cannot fork, so callers check :data:`HAS_FORK` first.
"""

from __future__ import annotations

import os
import signal
import socket
import time
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from cxbridge.run import watchdog

HAS_FORK: Final = hasattr(os, "fork")

# The modules without types, since type checkers for Windows do not know all their attributes.
_os: Any = os
_signal: Any = signal
_socket: Any = socket


def fork() -> int:
    """Fork this process, which may have no threads except :data:`cxbridge.run.watchdog.running_watchdogs`.

    :returns: the process id of the child; 0 in the child.
    :raises OSError: if the system lacks resources.
    """
    # A copy has only the forking thread, and locks that other threads hold would stay locked in the copy.
    paused_threads = [*watchdog.running_watchdogs]
    for thread in paused_threads:
        thread.stop()
    try:
        pid: int = _os.fork()
    finally:
        for thread in paused_threads:
            thread.start()
    return pid


def has_ended(child_pid: int) -> bool:
    """Return whether a child has ended, without waiting.

    :raises ChildProcessError: if the process is not a child, or an earlier call has returned True.
    """
    return os.waitpid(child_pid, _os.WNOHANG) != (0, 0)


def kill(pid: int) -> None:
    """End a process at once (kill -9).

    :raises ProcessLookupError: if the process has ended.
    """
    os.kill(pid, _signal.SIGKILL)


def make_local_socket() -> socket.socket:
    """Make a stream socket whose address is a path."""
    return socket.socket(_socket.AF_UNIX, socket.SOCK_STREAM)


def reset_signals() -> None:
    """Let SIGTERM and SIGHUP end this process in place of inherited handlers, and ignore SIGINT."""
    # the parent shares the inherited descriptor, and would handle the signals of this process
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(_signal.SIGHUP, signal.SIG_DFL)


def read_cpu_seconds(pid: int) -> float:
    """Return the processor time of a process.

    On systems without /proc, and for a process that is gone, return the monotonic time instead.
    """
    try:
        # the fields after the name of the program, which may have spaces and parentheses
        _, _, fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")
    except OSError:
        return time.monotonic()
    ticks_per_second: int = _os.sysconf("SC_CLK_TCK")
    user_ticks, system_ticks = fields.split()[11:13]  # utime and stime of proc(5)
    return (int(user_ticks) + int(system_ticks)) / ticks_per_second


def limit_cpu_seconds(seconds: int | None) -> None:
    """Let the system end this process after some seconds of processor time; None removes the limit."""
    resource: Any = import_module("resource")  # imported here, since Windows lacks the module
    _, hard_limit = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (hard_limit if seconds is None else seconds, hard_limit))
