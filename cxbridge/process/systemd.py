"""Notifies systemd of the state of a service: sd_notify(3), a datagram of lines to a socket."""

from __future__ import annotations

import contextlib
import os
import socket

from cxbridge.printing import one_line


class Notifier:
    """Reports a daemon's state to the service manager, if there is one.

    :param address: of the socket; that of the environment (``NOTIFY_SOCKET``) when None.
    """

    def __init__(self, address: str | None = None) -> None:
        found = os.environ.get("NOTIFY_SOCKET", "") if address is None else address
        self._address = "\0" + found[1:] if found.startswith("@") else found

    def ready(self, status: str) -> None:
        """Report that the daemon is up, and what it does."""
        self._send(f"READY=1\nSTATUS={one_line(status)}")

    def status(self, text: str) -> None:
        """Report how it stands, in one line."""
        self._send(f"STATUS={text}")

    def alive(self) -> None:
        """Report that it still works, for those who watch that."""
        self._send("WATCHDOG=1")

    def stopping(self) -> None:
        """Report that it comes to its end."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        if self._address and hasattr(socket, "AF_UNIX"):
            # that nobody listens is no reason not to serve
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            ):
                sender.setblocking(False)  # nor that somebody listens no more: the queue is full soon
                sender.sendto(text.encode(), self._address)
