"""Notifications of systemd about the state of a service by sd_notify(3), datagrams to a socket."""

from __future__ import annotations

import contextlib
import os
import socket

from cxbridge.printing import one_line


class Notifier:
    """Reports the state of a process to the service manager, if there is one.

    :param address: of the socket; None: ``NOTIFY_SOCKET`` of the environment.
    """

    def __init__(self, address: str | None = None) -> None:
        found = os.environ.get("NOTIFY_SOCKET", "") if address is None else address
        self._address = "\0" + found[1:] if found.startswith("@") else found

    def ready(self, status: str) -> None:
        """Report readiness with a status text."""
        self._send(f"READY=1\nSTATUS={one_line(status)}")

    def status(self, text: str) -> None:
        """Report a status text of one line."""
        self._send(f"STATUS={text}")

    def alive(self) -> None:
        """Report activity to systemd's watchdog."""
        self._send("WATCHDOG=1")

    def stopping(self) -> None:
        """Report that the process is stopping."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        if self._address and hasattr(socket, "AF_UNIX"):
            # a daemon also works if systemd does not listen
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            ):
                sender.setblocking(False)  # a full queue of a listener must not block the daemon

                sender.sendto(text.encode(), self._address)
