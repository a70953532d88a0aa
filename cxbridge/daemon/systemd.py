"""Notifications to systemd about the state of a service."""

from __future__ import annotations

import contextlib
import os
import socket

from cxbridge.printing import one_line


class SystemdNotifier:
    """Reports the state of a service to the service manager in datagrams to a socket, as sd_notify(3) does.

    :param address: the path of the socket, or ``@`` and the name of an abstract socket; by default the
        variable ``NOTIFY_SOCKET`` of the environment, without which nothing is sent.
    """

    def __init__(self, address: str | None = None) -> None:
        path = os.environ.get("NOTIFY_SOCKET", "") if address is None else address
        # @ stands for the NUL byte with which the system call starts the name of an abstract socket
        self._address = "\0" + path[1:] if path.startswith("@") else path

    def report_ready(self, status: str) -> None:
        """Report readiness with a status text."""
        # a line break in the status would begin another assignment, e.g. of MAINPID
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

    def _send(self, assignments: str) -> None:
        if self._address and hasattr(socket, "AF_UNIX"):  # Windows lacks it
            # the daemon must also work if systemd does not receive the notification
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            ):
                sender.setblocking(False)  # a full queue of the receiver must not block the daemon
                sender.sendto(assignments.encode(), self._address)
