"""Where servers may listen, and which pages of browsers may use them: the rules of all servers, here alone.

A server that more than this user's machine reaches needs keys, a token, a list of peers, or an option that
allows it to do without (docs/security.md).
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import ConfigError, CxbridgeError

LOOPBACK: Final = "127.0.0.1"
"""Where servers listen unless their settings say otherwise."""

LOCAL_NAMES: Final = frozenset({"localhost", LOOPBACK, "::1"})
"""Names of this machine in the header ``Host`` of a request."""


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a host. Names but ``localhost`` are not looked up."""
    try:
        address = ipaddress.ip_address(host.strip("[]").partition("%")[0])
    except ValueError:
        return host == "localhost"
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return (mapped or address).is_loopback


def is_abstract(endpoint: str) -> bool:
    """Return whether an endpoint is an abstract socket of Linux: a name without file, owner and mode."""
    return endpoint.startswith("ipc://@")


def is_private(endpoint: str) -> bool:
    """Return whether only this machine reaches an endpoint of ZeroMQ, and over ipc only its user."""
    if not endpoint.startswith("tcp://"):
        return not is_abstract(endpoint)
    try:
        return is_loopback(urlsplit(endpoint.replace(":*", ":0")).hostname or "")
    except ValueError:
        return False


def check_place(
    server: str,
    place: str,
    *,
    private: bool,
    admitted: bool,
    hint: str,
    error: type[CxbridgeError] = ConfigError,
) -> None:
    """Refuse a server that clients without permission reach.

    :param server: the server, for the error.
    :param place: the host or the endpoint.
    :param private: whether only this user or this machine reaches the place.
    :param admitted: whether keys, a token, a list of peers or an option say who may come.
    :raises CxbridgeError: of the class ``error``.
    """
    if not (private or admitted):
        reach = "by all users of" if is_abstract(place) else "from beyond"
        raise error(f"{server} at {place} could be reached {reach} this machine", hint=hint)


def is_named(host: str, names: Collection[str]) -> bool:
    """Return whether the header ``Host`` of a request, with or without port, has one of these names."""
    name = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
    return name.lower() in names


def is_own_page(origin: str, scheme: str, host: str, allowed: Collection[str]) -> bool:
    """Return whether a request comes from our own page, from an allowed one, or from no page of a browser.

    :param origin: the header ``Origin``; empty: the request has none.
    :param scheme: of the request.
    :param host: the header ``Host``.
    :param allowed: origins of other pages; ``*``: all.
    """
    return not origin or is_allowed(origin, allowed) or origin.lower() == f"{scheme}://{host}".lower()


def is_allowed(origin: str, allowed: Collection[str]) -> bool:
    """Return whether an origin is one of those that are allowed; ``*``: all are."""
    return bool(origin) and ("*" in allowed or origin in allowed)
