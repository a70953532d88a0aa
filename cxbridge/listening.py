"""Rules for the addresses of all servers.

A server needs keys, a token, a list of peers, or an explicit option if other machines can reach it, or if it
has an abstract socket, which all users of this machine can reach (docs/security.md).
"""

from __future__ import annotations

import ipaddress
import socket
from typing import Final
from urllib.parse import urlsplit

from cxbridge.errors import ConfigError, CxbridgeError

LOOPBACK: Final = "127.0.0.1"
"""The default host of servers."""


def is_loopback(host: str) -> bool:
    """Return whether a host is only reachable from this machine.

    ``localhost`` is the only such name, because a resolver may give any address to other names.
    """
    # an IPv6 address may have brackets, as in URLs, and a zone, as in fe80::1%eth0
    try:
        address = ipaddress.ip_address(host.strip("[]").partition("%")[0])
    except ValueError:
        return host == "localhost"
    # an IPv6 address may contain an IPv4 address, as in ::ffff:127.0.0.1
    ipv4_address = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return (ipv4_address or address).is_loopback


def url_host(host: str) -> str:
    """Return a host as URLs have it, an IPv6 address in brackets."""
    return f"[{host}]" if ":" in host else host


def is_abstract_socket(endpoint: str) -> bool:
    """Return whether an endpoint is an abstract socket of Linux, which has no file, owner and mode."""
    return endpoint.startswith("ipc://@")


def is_private_endpoint(endpoint: str) -> bool:
    """Return whether only this machine can reach a ZeroMQ endpoint, and over ``ipc`` only this user.

    An abstract socket is not private, because it has no owner.
    """
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
    error_class: type[CxbridgeError] = ConfigError,
) -> None:
    """Raise an error for a server that is neither local nor restricted.

    :param server: the server's name, for the error.
    :param address: the host or the endpoint.
    :param is_local: whether only this user or this machine can reach the server.
    :param is_restricted: whether keys, a token or a list of peers restrict the clients, or an option permits
        all clients.
    :raises CxbridgeError: of the class ``error_class``, if the server is neither local nor restricted.
    """
    if not (is_local or is_restricted):
        reach = "by all users of" if is_abstract_socket(address) else "from beyond"
        raise error_class(f"{server} at {address} could be reached {reach} this machine", hint=hint)


def listen(
    server: str,
    host: str,
    port: int,
    *,
    hint: str,
    backlog: int | None = None,
    error_class: type[CxbridgeError] = CxbridgeError,
) -> socket.socket:
    """Return a listening TCP socket, for IPv4 clients, too, if the host is ``::``.

    :param server: the server's name, for the error.
    :param port: the port; 0 for any free port.
    :param backlog: the number of connections that may wait to be accepted; None for Python's default.
    :raises CxbridgeError: of the class ``error_class`` if the address is unavailable.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listening_socket = socket.create_server(
            (host, port), family=family, backlog=backlog, dualstack_ipv6=family == socket.AF_INET6
        )
    except OSError as error:
        reason = str(error.strerror).partition(" (while")[0]  # `create_server` adds the address
        raise error_class(f"{server} cannot listen on {host}:{port}: {reason}", hint=hint) from error
    # accepted sockets inherit the option; Nagle's algorithm would delay answers by 40 ms
    listening_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listening_socket
