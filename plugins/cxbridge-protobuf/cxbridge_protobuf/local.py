"""Connections between environments of one process: no sockets, no threads, frames in the order of sending.

Ports are as on a network whose machines all have one address: a peer's message to a port reaches each other
peer that receives there, and a client reaches the server of its port. So runs repeat on the virtual clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Final

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import Event, Origin, Presence, Received, Warned
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import MessageTypes

HOST: Final = "127.0.0.1"
"""Where everything seems to come from."""


@dataclass(slots=True)
class _Peer:
    """A peer.

    :param key: secret and cipher; both empty for plain messages. Nothing is encrypted here, but who has
        another key cannot read it.
    :param is_deaf: whether a message with another key came already.
    """

    send_port: int
    recv_port: int
    key: tuple[str, str]
    is_deaf: bool = False


@dataclass(slots=True)
class _Link:
    """An end of a connection."""

    origin: Origin
    other: LocalConnections
    other_id: int
    port: int = 0
    """Of a client, as its server sees it."""


class LocalNetwork:
    """What joins the environments of one process."""

    def __init__(self) -> None:
        self.members: list[LocalConnections] = []
        self.ports = count(49152)
        """Of clients."""

    def join(
        self, types: MessageTypes, _settings: NetworkSettings, now_us: Callable[[], int]
    ) -> LocalConnections:
        """Return the connections of one more environment; a :data:`MakeConnections`."""
        member = LocalConnections(self, types, now_us)
        self.members.append(member)
        return member


class LocalConnections:
    """The server, the clients and the peers of an environment."""

    def __init__(self, network: LocalNetwork, types: MessageTypes, now_us: Callable[[], int]) -> None:
        self.types: Final = types
        self._network = network
        self._now_us = now_us
        self._ids = count(1)
        self._events: list[Event] = []
        self._peers: dict[int, _Peer] = {}
        self._links: dict[int, _Link] = {}
        self._server_port = 0

    def drain(self) -> list[Event]:
        """Return the messages since the last call."""
        events, self._events = self._events, []
        return events

    # -- connections

    def enable_server(self, port: int) -> None:
        """Let clients connect. Nothing happens when there is a server already, or the port is not above 0.

        :raises ProtobufError: when another one has the port.
        """
        if port <= 0 or self._server_port:
            return
        if any(member.serves(port) for member in self._network.members):
            raise ProtobufError(f"Cannot listen on {HOST} port {port}: address already in use")
        self._server_port = port

    def serves(self, port: int) -> bool:
        """Whether its server has this port."""
        return port > 0 and self._server_port == port

    def disable_server(self) -> None:
        """Refuse new connections, and close the connections of the server's clients."""
        self._server_port = 0
        for link_id, link in list(self._links.items()):
            if link.origin is Origin.SERVER:
                self.disconnect(link_id)

    def connect(self, host: str, port: int) -> int:
        """Connect to a server; return the client's id, 0 when the port is not above 0."""
        if port <= 0:
            return 0
        own = next(self._ids)
        server = next((member for member in self._network.members if member.serves(port)), None)
        if server is None:
            self._events += (
                Warned(f"Cannot connect to {host}:{port}: connection refused"),
                Presence(Origin.CLIENT, own, connected=False),
            )
            return own
        self._links[own] = _Link(Origin.CLIENT, server, server.accept(self, own))
        self._events.append(Presence(Origin.CLIENT, own, connected=True, host=host, port=port))
        return own

    def accept(self, client: LocalConnections, client_id: int) -> int:
        """Take a client in; return the id of this end."""
        own = next(self._ids)
        port = next(self._network.ports)
        self._links[own] = _Link(Origin.SERVER, client, client_id, port)
        self._events.append(Presence(Origin.SERVER, own, connected=True, host=HOST, port=port))
        return own

    def disconnect(self, link_id: int) -> None:
        """Close a connection; unknown ones are none of our business."""
        link = self._links.pop(link_id, None)
        if link is not None:
            link.other.lose(link.other_id)

    def lose(self, link_id: int) -> None:
        """Know that the other end has closed a connection."""
        link = self._links.pop(link_id, None)
        if link is not None:
            self._events.append(Presence(link.origin, link_id, connected=False))

    # -- peers

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:  # noqa: ARG002
        """Begin to send to a port and to receive on one; return the peer's id.

        :param recv_port: the same as ``send_port`` when it is not above 0.
        :returns: 0 when ``send_port`` is not above 0.
        """
        if send_port <= 0:
            return 0
        own = next(self._ids)
        self._peers[own] = _Peer(send_port, recv_port if recv_port > 0 else send_port, _key(secret, cipher))
        return own

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ones are none of our business."""
        self._peers.pop(peer_id, None)

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Let only those read a peer's messages who have the same secret."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            peer.key = _key(secret, cipher)
            peer.is_deaf = False

    # -- messages

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are none of our business."""
        link = self._links.get(link_id)
        if link is None:
            self.broadcast(link_id, frame)
        else:
            link.other.receive(link.other_id, frame)

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are none of our business."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            for member in self._network.members:
                sender = peer_id if member is self else 0
                member.receive_of_peer(peer.send_port, peer.recv_port, peer.key, frame, sender)

    def receive_of_peer(
        self, port: int, from_port: int, key: tuple[str, str], frame: Frame, sender: int
    ) -> None:
        """Receive the message of a peer to a port.

        :param sender: the peer, when it is of this environment; else 0. It does not hear itself.
        """
        for own, peer in self._peers.items():
            if own == sender:
                continue
            if peer.recv_port == port and peer.key == key:
                self._receive(Origin.PEER, own, from_port, frame)
            elif peer.recv_port == port and not peer.is_deaf:
                peer.is_deaf = True  # once is enough: what follows is not readable, either
                self._events.append(
                    Warned(f"Messages to port {port} have another key, or none: nobody here can read them")
                )

    def receive(self, link_id: int, frame: Frame) -> None:
        """Receive over a connection."""
        link = self._links.get(link_id)
        if link is not None:
            self._receive(link.origin, link_id, link.port, frame)

    def _receive(self, origin: Origin, link_id: int, port: int, frame: Frame) -> None:
        message, problem = None, ""
        try:
            message = self.types.parse(frame)
        except ProtobufError as error:
            problem = error.message
        if message is None and origin is Origin.PEER:
            self._events.append(Warned(f"Failed to receive peer message: Deserialization fail: {problem}"))
            return
        host = "" if origin is Origin.CLIENT else HOST
        self._events.append(
            Received(
                origin, link_id, host, port, frame.component, frame.type, self._now_us(), message, problem
            )
        )

    def close(self) -> None:
        """Leave the network."""
        self.disable_server()
        for link_id in list(self._links):
            self.disconnect(link_id)
        self._peers.clear()
        self._network.members.remove(self)


def _key(secret: str, cipher: str) -> tuple[str, str]:
    return (secret, cipher.lower()) if secret and cipher else ("", "")
