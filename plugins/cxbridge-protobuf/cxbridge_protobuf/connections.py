"""What an environment does with connections, over sockets or within the process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import Event
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import MessageTypes


class Connections(Protocol):
    """The server, the clients and the peers of an environment."""

    def drain(self) -> list[Event]:
        """Return the messages since the last call."""

    def enable_server(self, port: int) -> None:
        """Listen for clients."""

    def disable_server(self) -> None:
        """Listen no more."""

    def connect(self, host: str, port: int) -> int:
        """Connect to a server; return the client's id, 0 when the port is not above 0."""

    def disconnect(self, link_id: int) -> None:
        """Close a connection."""

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:
        """Send to an address and receive on a port; return the peer's id."""

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer."""

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Encrypt a peer's messages from now on; no more when the secret or the cipher is empty."""

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer."""

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer."""

    def close(self) -> None:
        """Close everything."""


MakeConnections: TypeAlias = Callable[[MessageTypes, NetworkSettings, Callable[[], int]], Connections]
"""Makes them from the types of messages, the settings, and a function that returns the time."""
