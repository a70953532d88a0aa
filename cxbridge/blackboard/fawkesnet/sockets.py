"""TCP sockets of Fawkes' protocol, set up as both ends need them."""

from __future__ import annotations

import contextlib
import socket
from typing import Final

GONE_SECONDS: Final = 20.0
"""Seconds without a sign of life from the machine at the other end until the connection ends."""

_PROBES: Final = 4
_QUICKACK: Final[int | None] = getattr(socket, "TCP_QUICKACK", None)


def tune(sock: socket.socket, gone_seconds: float = GONE_SECONDS) -> None:
    """Send frames at once, and find out when the other end is gone without a word.

    Keep-alive asks a silent peer; TCP_USER_TIMEOUT ends a connection without acknowledgements, which
    keep-alive leaves alone for a quarter of an hour.
    """
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (
        ("TCP_KEEPIDLE", max(int(gone_seconds / 2), 1)),
        ("TCP_KEEPINTVL", max(int(gone_seconds / 2 / _PROBES), 1)),
        ("TCP_KEEPCNT", _PROBES),
        ("TCP_USER_TIMEOUT", int(gone_seconds * 1000)),
    ):
        if hasattr(socket, option):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def acknowledge(sock: socket.socket) -> None:
    """Acknowledge received bytes at once, where the system can; to be called after each ``recv``.

    Fawkes writes header and payload apart and leaves Nagle's algorithm on, so the payload of whatever it
    sends stays there until the header is acknowledged. A system puts that off for up to 40 ms, and goes back
    to putting it off by itself.
    """
    if _QUICKACK is not None:
        with contextlib.suppress(OSError):  # it has ended: the next recv reports that
            sock.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
