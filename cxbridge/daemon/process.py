"""A server as a process of its system: the notifications of systemd, and the limit of open files."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from typing import Final

from cxbridge.printing import one_line

# The usual soft limit is 1024, and a server needs a descriptor for each client. A far higher limit would slow
# down child processes, which close all descriptors up to the limit.
_MAX_OPEN_FILES: Final = 16384


class Notifier:
    """Reports the state of a service to the service manager by sd_notify(3), datagrams to a socket.

    :param address: the path of the socket; by default the variable ``NOTIFY_SOCKET`` of the environment,
        without which nothing is sent.
    """

    def __init__(self, address: str | None = None) -> None:
        path = os.environ.get("NOTIFY_SOCKET", "") if address is None else address
        # @ stands for the NUL byte with which the system call starts the name of an abstract socket
        self._address = "\0" + path[1:] if path.startswith("@") else path

    def report_ready(self, status: str) -> None:
        """Report readiness with a status text."""
        self._send(f"READY=1\nSTATUS={one_line(status)}")

    def report_status(self, text: str) -> None:
        """Report a status text of one line."""
        self._send(f"STATUS={text}")

    def report_alive(self) -> None:
        """Report activity to systemd's watchdog."""
        self._send("WATCHDOG=1")

    def report_stopping(self) -> None:
        """Report that the process is stopping."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        if self._address and hasattr(socket, "AF_UNIX"):
            # the daemon must also work if systemd does not receive the notification
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            ):
                sender.setblocking(False)  # a full queue of the receiver must not block the daemon
                sender.sendto(text.encode(), self._address)


def raise_file_limit() -> None:
    """Raise the limit of open files and sockets to the maximum that the system allows, at most 16384."""
    if sys.platform == "win32":
        return
    try:
        import resource  # noqa: PLC0415 - not every system has it
    except ImportError:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = _MAX_OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, _MAX_OPEN_FILES)
    if soft != resource.RLIM_INFINITY and soft < limit:
        with contextlib.suppress(OSError, ValueError):  # macOS has a second, lower limit
            resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
