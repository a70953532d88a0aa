"""The address of a Fawkes, from its URL."""

from __future__ import annotations

from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import BlackBoardError

DEFAULT_PORT: Final = 1910  # Fawkes' default
SCHEME: Final = "fawkes"


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
