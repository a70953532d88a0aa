"""The addresses that may connect to the server for Fawkes' tools.

Fawkes' protocol has no login, so the address of a peer is the only check of its identity.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from typing import Final

from cxbridge.errors import BlackBoardError
from cxbridge.listening import is_loopback

_Network = ipaddress.IPv4Network | ipaddress.IPv6Network


class AllowedPeers:
    """The peers that may connect: those at loopback addresses, and the allowed peers.

    :param allowed: addresses (``192.168.0.7``) or networks (``192.168.0.0/24``).
    :raises BlackBoardError: if a text is neither an address nor a network.
    """

    def __init__(self, allowed: Iterable[str] = ()) -> None:
        self._networks: Final = [_parse_network(text) for text in allowed]

    def admits(self, host: str) -> bool:
        """Return whether the peer at an address may connect; False for a text that is not an address."""
        try:
            # without the zone of an IPv6 address, fe80::1%eth0
            address = ipaddress.ip_address(host.partition("%")[0])
        except ValueError:
            return False
        # dual-stack sockets report IPv4 peers as ::ffff:a.b.c.d
        address = getattr(address, "ipv4_mapped", None) or address
        return is_loopback(str(address)) or any(address in network for network in self._networks)


def _parse_network(text: str) -> _Network:
    try:
        # not strict: users write the address of a machine in the network, 192.168.0.7/24
        return ipaddress.ip_network(text, strict=False)
    except ValueError as error:
        raise BlackBoardError(
            f"'{text}' is not an address or network: {error}", hint="write e.g. 192.168.0.7 or 192.168.0.0/24"
        ) from None
