"""Connections between environments of one process: no sockets, no threads, frames in sending order.

Ports work as if all environments had one address: a peer's message reaches each other peer that receives on
the port, and a client reaches the server of its port. Runs are therefore repeatable on the virtual clock.
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

HOST: Final = "127.0.0.1"  # the address that all messages come from


@dataclass(slots=True)
class _Peer:
    """A peer.

    :param key: the secret and the cipher; both empty for plain messages. Messages are not encrypted here, but
        a peer with another key does not receive them.
    :param is_deaf: whether a message with another key has already arrived.
    """

    send_port: int
    recv_port: int
    key: tuple[str, str]
    is_deaf: bool = False


@dataclass(slots=True)
class _Link:
    """One end of a connection."""

    origin: Origin
    peer: LocalConnections
    peer_id: int
    port: int = 0  # port of the client, at the server's end


class LocalNetwork:
    """The connections between the environments of one process."""

    def __init__(self) -> None:
        self.members: list[LocalConnections] = []
        self.ports = count(49152)  # ports of clients, from the range of dynamic ports

    def join(
        self, types: MessageTypes, _settings: NetworkSettings, now_us: Callable[[], int]
    ) -> LocalConnections:
        """Return the connections of a further environment; a :data:`MakeConnections`."""
        member = LocalConnections(self, types, now_us)
        self.members.append(member)
        return member


class LocalConnections:
    """The connections of one environment; its network finds the receivers."""

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
        events, self._events = self._events, []
        return events

    # -- connections

    def enable_server(self, port: int) -> None:
        """Accept clients; ignored if a server exists or the port is below 1.

        :raises ProtobufError: if the port is taken.
        """
        if port <= 0 or self._server_port:
            return
        if any(member.serves(port) for member in self._network.members):
            raise ProtobufError(f"Cannot listen on {HOST} port {port}: address already in use")
        self._server_port = port

    def serves(self, port: int) -> bool:
        return port > 0 and self._server_port == port

    def disable_server(self) -> None:
        """Refuse further connections and close those of the server's clients."""
        self._server_port = 0
        for link_id, link in list(self._links.items()):
            if link.origin is Origin.SERVER:
                self.disconnect(link_id)

    def connect(self, host: str, port: int) -> int:
        """Connect to a server; return the client's id, or 0 for a port below 1."""
        if port <= 0:
            return 0
        client_id = next(self._ids)
        server = next((member for member in self._network.members if member.serves(port)), None)
        if server is None:
            self._events += (
                Warned(f"Cannot connect to {host}:{port}: connection refused"),
                Presence(Origin.CLIENT, client_id, connected=False),
            )
            return client_id
        self._links[client_id] = _Link(Origin.CLIENT, server, server.accept(self, client_id))
        self._events.append(Presence(Origin.CLIENT, client_id, connected=True, host=host, port=port))
        return client_id

    def accept(self, client: LocalConnections, client_id: int) -> int:
        """Accept a client; return the id of the server's end."""
        server_link_id = next(self._ids)
        port = next(self._network.ports)
        self._links[server_link_id] = _Link(Origin.SERVER, client, client_id, port)
        self._events.append(Presence(Origin.SERVER, server_link_id, connected=True, host=HOST, port=port))
        return server_link_id

    def disconnect(self, link_id: int) -> None:
        """Close a connection; unknown ids are ignored."""
        link = self._links.pop(link_id, None)
        if link is not None:
            link.peer.lose(link.peer_id)

    def lose(self, link_id: int) -> None:
        """Report that the peer has closed a connection."""
        link = self._links.pop(link_id, None)
        if link is not None:
            self._events.append(Presence(link.origin, link_id, connected=False))

    # -- peers

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:  # noqa: ARG002 - all hosts are one
        """Create a peer and return its id; 0 if ``send_port`` is below 1.

        :param recv_port: the receiving port; below 1 for the same port as ``send_port``.
        """
        if send_port <= 0:
            return 0
        peer_id = next(self._ids)
        self._peers[peer_id] = _Peer(
            send_port, recv_port if recv_port > 0 else send_port, _key(secret, cipher)
        )
        return peer_id

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ids are ignored."""
        self._peers.pop(peer_id, None)

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Make a peer's messages readable only with the same secret and cipher."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            peer.key = _key(secret, cipher)
            peer.is_deaf = False

    # -- messages

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are ignored."""
        link = self._links.get(link_id)
        if link is None:
            self.broadcast(link_id, frame)
        else:
            link.peer.receive(link.peer_id, frame)

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are ignored."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            for member in self._network.members:
                sender = peer_id if member is self else 0
                member.receive_of_peer(peer.send_port, peer.recv_port, peer.key, frame, sender)

    def receive_of_peer(
        self, port: int, from_port: int, key: tuple[str, str], frame: Frame, sender: int
    ) -> None:
        """Deliver a peer's message to the peers on a port.

        :param from_port: the port that the message comes from.
        :param sender: the id of the sending peer if the peer belongs to this environment, else 0; a peer does
            not receive its own messages.
        """
        for peer_id, peer in self._peers.items():
            if peer_id == sender:
                continue
            if peer.recv_port == port and peer.key == key:
                self._receive(Origin.PEER, peer_id, from_port, frame)
            elif peer.recv_port == port and not peer.is_deaf:
                peer.is_deaf = True  # one warning suffices: further messages are not readable, either
                self._events.append(
                    Warned(f"Messages to port {port} have another key, or none: nobody here can read them")
                )

    def receive(self, link_id: int, frame: Frame) -> None:
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
        # as over sockets: facts of clients do not name the server
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
