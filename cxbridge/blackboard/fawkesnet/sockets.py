"""The address in a URL of Fawkes' server, and socket options for both sides of the protocol."""

from __future__ import annotations

import contextlib
import socket
from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import BlackBoardError

DEFAULT_PORT: Final = 1910  # Fawkes' default
SCHEME: Final = "fawkes"

GONE_SECONDS: Final = 20.0
"""Seconds without a sign of life of the other machine until the connection ends."""

_PROBES: Final = 4  # TCP keep-alive probes without reply after which the peer counts as gone
_QUICKACK: Final[int | None] = getattr(socket, "TCP_QUICKACK", None)


def tune(sock: socket.socket, gone_seconds: float = GONE_SECONDS) -> None:
    """Disable Nagle's algorithm, and detect a silently lost peer."""
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    # keep-alive probes a silent peer; TCP_USER_TIMEOUT ends a connection with unacknowledged data, which
    # keep-alive would leave open for a quarter of an hour
    for option, value in (
        ("TCP_KEEPIDLE", max(int(gone_seconds / 2), 1)),
        ("TCP_KEEPINTVL", max(int(gone_seconds / 2 / _PROBES), 1)),
        ("TCP_KEEPCNT", _PROBES),
        ("TCP_USER_TIMEOUT", int(gone_seconds * 1000)),
    ):
        if hasattr(socket, option):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def acknowledge(sock: socket.socket) -> None:
    """Acknowledge received bytes immediately if the system supports it. To be called after each ``recv``."""
    # Fawkes sends header and payload separately with Nagle's algorithm, so the payload waits for the
    # acknowledgement of the header, which the system delays by up to 40 ms; the option resets itself
    if _QUICKACK is not None:
        with contextlib.suppress(OSError):  # the connection has ended; the next recv reports it
            sock.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)


def parse_url(url: str) -> tuple[str, int]:
    """Return host and port of ``fawkes://host:port``, by default port 1910.

    :raises BlackBoardError: if the URL is invalid.
    """
    try:
        address = urlsplit(url)
        host, port = address.hostname, address.port
    except ValueError as error:
        raise _unusable(url, str(error)) from None
    if address.scheme != SCHEME:
        raise _unusable(url, f"it does not begin with {SCHEME}://")
    if not host:
        raise _unusable(url, "it names no host")
    if address.path not in ("", "/") or address.query or address.fragment or address.username:
        raise _unusable(url, "there is more than a host and a port")
    return host, DEFAULT_PORT if port is None else port


def _unusable(url: str, reason: str) -> BlackBoardError:
    return BlackBoardError(
        f"cannot use '{url}': {reason}", hint="write fawkes://host:port, e.g. fawkes://robot:1910"
    )
