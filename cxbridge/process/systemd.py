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
        """Report that the daemon is up, with a status text."""
        self._send(f"READY=1\nSTATUS={one_line(status)}")

    def status(self, text: str) -> None:
        """Report how it stands, in one line."""
        self._send(f"STATUS={text}")

    def alive(self) -> None:
        """Report that the daemon still works, for systemd's watchdog."""
        self._send("WATCHDOG=1")

    def stopping(self) -> None:
        """Report that it comes to its end."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        if self._address and hasattr(socket, "AF_UNIX"):
            # a daemon serves also when systemd does not listen
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            ):
                sender.setblocking(
                    False
                )  # nor does a full queue of a listener that stopped reading hold the daemon up
                sender.sendto(text.encode(), self._address)
