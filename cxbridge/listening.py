"""Rules for the addresses of all servers, and for pages of browsers that may use them.

A server that can be reached from outside of this user's machine needs keys, a token, a list of peers, or an
explicit option (docs/security.md).
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import ConfigError, CxbridgeError

LOOPBACK: Final = "127.0.0.1"
"""The default host of servers."""

LOCAL_NAMES: Final = frozenset({"localhost", LOOPBACK, "::1"})
"""The names of this machine in the header ``Host``."""


def is_loopback(host: str) -> bool:
    """Return whether a host is only reachable from this machine.

    ``localhost`` is the only such name, because a resolver may give any address to other names.
    """
    try:
        address = ipaddress.ip_address(host.strip("[]").partition("%")[0])
    except ValueError:
        return host == "localhost"
    # an IPv6 address may contain an IPv4 address, as in ::ffff:127.0.0.1
    ipv4_address = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return (ipv4_address or address).is_loopback


def is_abstract_socket(endpoint: str) -> bool:
    """Return whether an endpoint is an abstract socket of Linux, which has no file, owner and mode."""
    return endpoint.startswith("ipc://@")


def is_private_endpoint(endpoint: str) -> bool:
    """Return whether a ZeroMQ endpoint is only reachable from this machine, over ipc only by its user."""
    if not endpoint.startswith("tcp://"):
        return not is_abstract_socket(endpoint)
    try:
        # ZeroMQ's `*` for any free port is not a valid port of a URL
        return is_loopback(urlsplit(endpoint.replace(":*", ":0")).hostname or "")
    except ValueError:
        return False


def check_server_address(
    server: str,
    address: str,
    *,
    is_local: bool,
    is_restricted: bool,
    hint: str,
    error: type[CxbridgeError] = ConfigError,
) -> None:
    """Raise an error for a server that anybody on the network can reach.

    :param address: the host or the endpoint.
    :param is_local: whether only this user or this machine can reach the server.
    :param is_restricted: whether keys, a token or a list of peers restrict the clients, or an option permits
        all clients.
    :raises CxbridgeError: of the class ``error``.
    """
    if not (is_local or is_restricted):
        reach = "by all users of" if is_abstract_socket(address) else "from beyond"
        raise error(f"{server} at {address} could be reached {reach} this machine", hint=hint)


def has_host_name(host: str, names: Collection[str]) -> bool:
    """Return whether the header ``Host``, with or without port, has one of these names."""
    name = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
    return name.lower() in names


def is_permitted_request(origin: str, scheme: str, host: str, allowed_origins: Collection[str]) -> bool:
    """Return whether a request comes from the server's own page or from an allowed page.

    Requests of other programs than browsers have no origin, and are permitted, too.

    :param origin: the header ``Origin``, empty without one.
    :param scheme: the scheme of the request, ``http`` or ``https``.
    :param host: the header ``Host``.
    :param allowed_origins: the origins of other permitted pages; ``*`` allows all.
    """
    return (
        not origin
        or is_allowed_origin(origin, allowed_origins)
        or origin.lower() == f"{scheme}://{host}".lower()
    )


def is_allowed_origin(origin: str, allowed_origins: Collection[str]) -> bool:
    """Return whether an origin is allowed; ``*`` allows all."""
    return bool(origin) and ("*" in allowed_origins or origin in allowed_origins)
