"""URLs of Fawkes' server, and the socket options of client and server."""

from __future__ import annotations

import contextlib
import socket
from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import BlackBoardError

DEFAULT_PORT: Final = 1910  # Fawkes' default
SCHEME: Final = "fawkes"

# chosen freely
GONE_TIMEOUT_S: Final = 20.0
"""Seconds without packets from the other machine after which the connection ends."""

_KEEPALIVE_PROBES: Final = 4  # unanswered TCP keep-alive probes that end a connection; single probes get lost
_QUICKACK: Final[int | None] = getattr(socket, "TCP_QUICKACK", None)  # None: the system has no such option


def configure_socket(sock: socket.socket) -> None:
    """Disable Nagle's algorithm, and end the connection to a machine that vanished without a packet."""
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    # keep-alive probes a silent machine, first after half of the time; TCP_USER_TIMEOUT ends a connection
    # with unacknowledged data, which keep-alive would leave open for a quarter of an hour
    for option, value in (
        ("TCP_KEEPIDLE", max(int(GONE_TIMEOUT_S / 2), 1)),
        ("TCP_KEEPINTVL", max(int(GONE_TIMEOUT_S / 2 / _KEEPALIVE_PROBES), 1)),
        ("TCP_KEEPCNT", _KEEPALIVE_PROBES),
        ("TCP_USER_TIMEOUT", int(GONE_TIMEOUT_S * 1000)),
    ):
        if hasattr(socket, option):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def acknowledge_at_once(sock: socket.socket) -> None:
    """Acknowledge the bytes of the last ``recv`` immediately, if the system supports it."""
    # Fawkes sends header and payload separately with Nagle's algorithm, so the payload waits for the
    # acknowledgement of the header, which the kernel delays by up to 40 ms; the kernel resets the option
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
        raise _make_url_error(url, str(error)) from None
    if address.scheme != SCHEME:
        raise _make_url_error(url, f"it does not begin with {SCHEME}://")
    if not host:
        raise _make_url_error(url, "the host is missing")
    if address.path not in ("", "/") or address.query or address.fragment or address.username:
        raise _make_url_error(url, "only a host and a port may follow the scheme")
    return host, DEFAULT_PORT if port is None else port


def _make_url_error(url: str, reason: str) -> BlackBoardError:
    return BlackBoardError(
        f"cannot use '{url}': {reason}", hint="write fawkes://host:port, e.g. fawkes://robot:1910"
    )
