"""Connections between the environments of a process, without sockets and threads.

Frames arrive in sending order, so runs on the virtual clock are repeatable. Ports work as if all environments
had the same address: the message of a peer reaches each other peer that receives on the port, and a client
reaches the server of its port.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Final

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import ConnectionChange, InboxEvent, LinkRole, LogWarning, parse_message
from cxbridge_protobuf.types import MessageTypes

LOCAL_HOST: Final = "127.0.0.1"  # the address of all senders


@dataclass(slots=True)
class _LocalPeer:
    """A peer.

    :param key: the secret and the cipher; both empty for unencrypted messages. Here no message is encrypted,
        but a peer with another key does not receive the message.
    :param has_warned: whether the log has the warning about messages with another key.
    """

    send_port: int
    recv_port: int
    key: tuple[str, str]
    has_warned: bool = False


@dataclass(slots=True)
class _LocalLink:
    """A link: one end of a connection.

    :param opposite: the connections of the environment at the opposite end.
    :param opposite_link_id: the id of the link there.
    """

    role: LinkRole
    opposite: LocalConnections
    opposite_link_id: int
    port: int = 0  # the port of the client, at the server's end


class LocalNetwork:
    """The connections between the environments of one process."""

    def __init__(self) -> None:
        self.members: list[LocalConnections] = []
        self.ports = count(49152)  # ports of clients, from the start of the range of dynamic ports

    def join(self, types: MessageTypes, now_us: Callable[[], int]) -> LocalConnections:
        """Return the connections of another environment. The method is a :data:`MakeConnections`."""
        member = LocalConnections(self, types, now_us)
        self.members.append(member)
        return member


class LocalConnections:
    """The connections of one environment."""

    def __init__(self, network: LocalNetwork, types: MessageTypes, now_us: Callable[[], int]) -> None:
        self.types: Final = types
        self._network = network
        self._now_us = now_us
        self._ids = count(1)
        self._events: list[InboxEvent] = []
        self._peers: dict[int, _LocalPeer] = {}
        self._links: dict[int, _LocalLink] = {}
        self._server_port = 0

    def drain(self) -> list[InboxEvent]:
        events, self._events = self._events, []
        return events

    # -- connections

    def enable_server(self, port: int) -> None:
        """Accept clients; ignored if a server exists or the port is below 1.

        :raises ProtobufError: if the port is taken.
        """
        if port <= 0 or self._server_port:
            return
        if any(member.is_serving(port) for member in self._network.members):
            raise ProtobufError(f"Cannot listen on {LOCAL_HOST} port {port}: address already in use")
        self._server_port = port

    def is_serving(self, port: int) -> bool:
        return port > 0 and self._server_port == port

    def disable_server(self) -> None:
        """Reject new clients, and close the connections of the server's clients."""
        self._server_port = 0
        for link_id, link in list(self._links.items()):
            if link.role is LinkRole.SERVER:
                self.disconnect(link_id)

    def connect(self, host: str, port: int) -> int:
        """Connect to a server; return the client's id, or 0 for a port below 1."""
        if port <= 0:
            return 0
        client_id = next(self._ids)
        server = next((member for member in self._network.members if member.is_serving(port)), None)
        if server is None:
            self._events += (
                LogWarning(f"Cannot connect to {host}:{port}: connection refused"),
                ConnectionChange(LinkRole.CLIENT, client_id, is_connected=False),
            )
            return client_id
        self._links[client_id] = _LocalLink(LinkRole.CLIENT, server, server.accept(self, client_id))
        self._events.append(
            ConnectionChange(LinkRole.CLIENT, client_id, is_connected=True, host=host, port=port)
        )
        return client_id

    def accept(self, client: LocalConnections, client_id: int) -> int:
        """Accept a client; return the id of the server's end."""
        server_link_id = next(self._ids)
        port = next(self._network.ports)
        self._links[server_link_id] = _LocalLink(LinkRole.SERVER, client, client_id, port)
        self._events.append(
            ConnectionChange(LinkRole.SERVER, server_link_id, is_connected=True, host=LOCAL_HOST, port=port)
        )
        return server_link_id

    def disconnect(self, link_id: int) -> None:
        """Close a link; unknown ids are ignored."""
        link = self._links.pop(link_id, None)
        if link is not None:
            link.opposite.report_end(link.opposite_link_id)

    def report_end(self, link_id: int) -> None:
        """Report that the opposite end has closed a connection."""
        link = self._links.pop(link_id, None)
        if link is not None:
            self._events.append(ConnectionChange(link.role, link_id, is_connected=False))

    # -- peers

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:  # noqa: ARG002 - all peers have one host
        """Create a peer and return its id; 0 if ``send_port`` is below 1.

        :param recv_port: the receiving port; below 1 for the same port as ``send_port``.
        """
        if send_port <= 0:
            return 0
        peer_id = next(self._ids)
        self._peers[peer_id] = _LocalPeer(
            send_port, recv_port if recv_port > 0 else send_port, _make_key(secret, cipher)
        )
        return peer_id

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ids are ignored."""
        self._peers.pop(peer_id, None)

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Let a peer exchange messages only with peers of the same secret and cipher from now on.

        If the secret or the cipher is empty, these are the peers without encryption.
        """
        peer = self._peers.get(peer_id)
        if peer is not None:
            peer.key = _make_key(secret, cipher)
            peer.has_warned = False

    # -- messages

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are ignored."""
        link = self._links.get(link_id)
        if link is None:
            self.broadcast(link_id, frame)
        else:
            link.opposite.receive_frame(link.opposite_link_id, frame)

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are ignored."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            for member in self._network.members:
                sender_id = peer_id if member is self else 0
                member.receive_broadcast(peer.send_port, peer.recv_port, peer.key, frame, sender_id)

    def receive_broadcast(
        self, port: int, sender_port: int, key: tuple[str, str], frame: Frame, sender_id: int
    ) -> None:
        """Deliver a peer's message to the peers of this environment that receive on a port.

        :param sender_port: the port of the sender.
        :param sender_id: the id of the sending peer if the peer belongs to this environment, else 0; a peer
            does not receive its own messages.
        """
        for peer_id, peer in self._peers.items():
            if peer_id == sender_id:
                continue
            if peer.recv_port == port and peer.key == key:
                self._add_message_event(LinkRole.PEER, peer_id, sender_port, frame)
            elif peer.recv_port == port and not peer.has_warned:
                peer.has_warned = True  # one warning suffices: later messages are not readable, either
                self._events.append(
                    LogWarning(
                        f"Messages to port {port} have a different key or none: "
                        f"peer {peer_id} of this process cannot read them"
                    )
                )

    def receive_frame(self, link_id: int, frame: Frame) -> None:
        link = self._links.get(link_id)
        if link is not None:
            self._add_message_event(link.role, link_id, link.port, frame)

    def _add_message_event(self, role: LinkRole, link_id: int, port: int, frame: Frame) -> None:
        # as over sockets, the facts of a client do not name the server
        host = "" if role is LinkRole.CLIENT else LOCAL_HOST
        event = parse_message(self.types, frame, role, link_id, host, port, self._now_us())
        if event.message is None and role is LinkRole.PEER:
            text = f"Failed to receive peer message: Deserialization fail: {event.problem}"
            self._events.append(LogWarning(text))
        else:
            self._events.append(event)

    def close(self) -> None:
        """Close all connections and peers, and leave the network."""
        self.disable_server()
        for link_id in list(self._links):
            self.disconnect(link_id)
        self._peers.clear()
        self._network.members.remove(self)


def _make_key(secret: str, cipher: str) -> tuple[str, str]:
    """Return the key of a :class:`_LocalPeer`. Upper and lower case of the cipher make no difference."""
    return (secret, cipher.lower()) if secret and cipher else ("", "")
