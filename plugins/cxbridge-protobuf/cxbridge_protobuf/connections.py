"""The interface of the connections of a CLIPS environment.

A connection links a client with a server over TCP. A peer broadcasts messages over UDP. The class
``SocketConnections`` implements the interface with sockets, ``LocalConnections`` within the process.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import InboxEvent
from cxbridge_protobuf.types import MessageTypes


class Connections(Protocol):
    """The server, clients and peers of an environment; connections and peers get ids from one counter."""

    def drain(self) -> list[InboxEvent]:
        """Return the events since the last call."""

    def enable_server(self, port: int) -> None:
        """Listen for clients; ignored if a server exists or the port is below 1.

        :raises ProtobufError: if the port is unavailable.
        """

    def disable_server(self) -> None:
        """Stop listening, and close the connections of the server's clients."""

    def connect(self, host: str, port: int) -> int:
        """Connect to a server; return the client's id, or 0 for a port below 1."""

    def disconnect(self, link_id: int) -> None:
        """Close a connection of a client or the server; unknown ids are ignored."""

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:
        """Create a peer that sends to an address and receives on a port.

        :param recv_port: the receiving port; below 1 for the same port as ``send_port``.
        :param secret: the secret for encryption; with an empty secret or cipher, messages are unencrypted.
        :returns: the id of the peer, or 0 if ``send_port`` is below 1.
        :raises ProtobufError: if the peer cannot be created.
        """

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ids are ignored."""

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Encrypt a peer's messages from now on; an empty secret or cipher ends encryption.

        Unknown ids are ignored.

        :raises ProtobufError: if the cipher is unknown.
        """

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are ignored.

        :raises ProtobufError: if the message cannot be sent.
        """

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are ignored.

        :raises ProtobufError: if the message cannot be sent.
        """

    def close(self) -> None:
        """Close all connections and peers."""


# creates connections from message types, and a function that returns the time in microseconds
MakeConnections: TypeAlias = Callable[[MessageTypes, Callable[[], int]], Connections]
