"""The connections of an environment over sockets.

A thread with an asyncio loop reads the sockets, and adds received messages to an inbox. The environment calls
the methods of :class:`SocketConnections` from its own thread. docs/evidence/protocol-protobuf.md
describes the behaviour.
"""

from __future__ import annotations

import asyncio
import itertools
import socket
import threading
from collections.abc import Callable, Coroutine
from typing import Any, Final, TypeVar

from cxbridge.blackboard.kit.event_loop import LoopThread
from cxbridge.errors import ProtobufError
from cxbridge.listening import LOOPBACK
from cxbridge_protobuf import frames
from cxbridge_protobuf.crypto import Crypter
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import ConnectionChange, Inbox, InboxEvent, LinkRole, parse_message
from cxbridge_protobuf.peer import MAX_PEER_BYTES, Peer
from cxbridge_protobuf.stream import MAX_MESSAGE_BYTES, StreamLink
from cxbridge_protobuf.types import MessageTypes

ResultT = TypeVar("ResultT")

MAX_CLIENTS: Final = 256  # clients of a server; additional clients are disconnected

# far longer than any work of the thread, except for the look-up of a host whose name server does not answer
_THREAD_TIMEOUT_S = 10
_ALL_INTERFACES = "*"  # the setting of the server's address for all network interfaces
_MAX_PORT = 65535


class SocketConnections:
    """The server, clients and peers of an environment.

    :param types: the parser of messages.
    :param now_us: the clock for time stamps of messages.
    :param server_address: the address of the server; ``*``: all network interfaces.
    """

    def __init__(
        self, types: MessageTypes, now_us: Callable[[], int], server_address: str = LOOPBACK
    ) -> None:
        self._types = types
        self._server_address = server_address
        self.inbox: Final = Inbox(now_us)
        self._ids = itertools.count(1)
        # guards the changes of `_links`, which both threads make, and of `_peers`; a single look-up or copy
        # needs no lock
        self._lock = threading.Lock()
        self._links: dict[int, StreamLink] = {}
        self._peers: dict[int, Peer] = {}
        self._server: asyncio.Server | None = None
        self._thread: LoopThread | None = None

    # -- the environment's side

    def drain(self) -> list[InboxEvent]:
        """Return the events since the last call, and resume paused reading."""
        events, was_full = self.inbox.drain()
        if was_full:
            self._call_in_thread(self._resume_reading)
        return events

    def enable_server(self, port: int) -> None:
        """Listen for clients; ignored if a server exists or the port is below 1.

        :raises ProtobufError: if the port is unavailable.
        """
        if port <= 0 or self._server is not None:
            return
        server_socket = self._open_server_socket(port)
        # accepted sockets inherit the option; Nagle's algorithm would delay messages by up to 40 ms, and
        # asyncio sets the option only for sockets that were opened with IPPROTO_TCP
        server_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

        async def start() -> None:
            # set in the thread: a client may connect before the environment's thread continues
            self._server = await asyncio.get_running_loop().create_server(
                self._make_server_link, sock=server_socket
            )

        self._run_in_thread(start())

    def disable_server(self) -> None:
        """Stop listening and close the connections of the server's clients."""
        server, self._server = self._server, None
        if server is not None:

            async def stop() -> None:
                server.close()

            self._run_in_thread(stop())
            for link in self._remove_links(LinkRole.SERVER):
                self._call_in_thread(link.close)

    def connect(self, host: str, port: int) -> int:
        """Start a connection to a server; return the client's id, or 0 for a port below 1."""
        if port <= 0:
            return 0
        link = StreamLink(next(self._ids), LinkRole.CLIENT, self)
        with self._lock:
            self._links[link.id] = link
        self._ensure_thread().spawn(self._connect(link, host, port))
        return link.id

    def disconnect(self, link_id: int) -> None:
        """Close a connection of a client or the server; unknown ids are ignored."""
        with self._lock:
            link = self._links.pop(link_id, None)
        if link is not None:
            self._call_in_thread(link.close)

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:
        """Create a peer that sends to an address and receives on a port; return its id.

        :param recv_port: the receiving port; below 1 for the same port as ``send_port``.
        :param secret: the secret for encryption; empty for unencrypted messages.
        :returns: 0 if ``send_port`` is below 1.
        :raises ProtobufError: if a port or the cipher is unavailable, or the host is unknown.
        :raises TimeoutError: if the look-up of the host takes longer than 10 s.
        """
        if send_port <= 0:
            return 0
        for port in (send_port, recv_port):
            _check_port(port)
        crypter = _make_crypter(secret, cipher)
        peer = Peer(next(self._ids), address, send_port, crypter, self._receive_message, self.inbox)
        self._run_in_thread(peer.open(recv_port if recv_port > 0 else send_port))
        with self._lock:
            self._peers[peer.id] = peer
        return peer.id

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ids are ignored."""
        with self._lock:
            peer = self._peers.pop(peer_id, None)
        if peer is not None:
            self._run_in_thread(peer.close())

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Encrypt a peer's messages from now on; an empty secret or cipher ends encryption.

        Unknown ids are ignored.

        :raises ProtobufError: if the cipher is unknown.
        """
        peer = self._peers.get(peer_id)
        if peer is not None:
            peer.crypter = _make_crypter(secret, cipher)

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are ignored.

        :raises ProtobufError: if the connection is not open, or the message is too long.
        """
        link = self._links.get(link_id)
        if link is None:
            self.broadcast(link_id, frame)
            return
        if len(frame.encoded_message) > MAX_MESSAGE_BYTES:
            raise ProtobufError("Serialized message too big")
        if not link.is_connected:
            raise ProtobufError("Cannot send while not connected")
        self._call_in_thread(link.write, frames.encode_frame(frame))

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are ignored.

        :raises ProtobufError: if the message is too long.
        """
        peer = self._peers.get(peer_id)
        if peer is None:
            return
        if len(frame.encoded_message) > MAX_PEER_BYTES:
            raise ProtobufError("Serialized message too big")
        self._call_in_thread(peer.send, frame)

    def close(self) -> None:
        """Close all connections and end the thread; the object must not be used afterwards."""
        self.disable_server()
        for link in self._remove_links():
            self._call_in_thread(link.close)
        for peer_id in list(self._peers):
            self.destroy_peer(peer_id)
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.close()

    def _open_server_socket(self, port: int) -> socket.socket:
        _check_port(port)
        address = self._server_address
        try:
            if address == _ALL_INTERFACES:
                if socket.has_dualstack_ipv6():
                    return socket.create_server(("", port), family=socket.AF_INET6, dualstack_ipv6=True)
                return socket.create_server(("", port))
            family = socket.AF_INET6 if ":" in address else socket.AF_INET
            return socket.create_server((address, port), family=family)
        except OSError as error:
            raise ProtobufError(
                f"Cannot listen on {address} port {port}: {error.strerror or error}"
            ) from None

    def _remove_links(self, role: LinkRole | None = None) -> list[StreamLink]:
        """Remove and return the connections of a role, or all connections."""
        with self._lock:
            links = [link for link in self._links.values() if role is None or link.role is role]
            for link in links:
                del self._links[link.id]
        return links

    # -- the thread

    def _ensure_thread(self) -> LoopThread:
        """Return the thread; started by the first call, since many environments have no connections."""
        if self._thread is None:
            self._thread = LoopThread("clips-protobuf")
        return self._thread

    def _run_in_thread(self, coroutine: Coroutine[Any, Any, ResultT]) -> ResultT:
        """Run a coroutine in the thread and wait for its result."""
        return self._ensure_thread().spawn(coroutine).result(_THREAD_TIMEOUT_S)

    def _call_in_thread(self, function: Callable[..., object], *arguments: object) -> None:
        """Call a function in the thread; do nothing without a thread, since then there are no connections."""
        if self._thread is not None:
            self._thread.call(function, *arguments)

    async def _connect(self, link: StreamLink, host: str, port: int) -> None:
        try:
            await asyncio.get_running_loop().create_connection(lambda: link, host, port)
        # OverflowError: a port above 65535; UnicodeError: a host name that IDNA cannot encode
        except (OSError, OverflowError, UnicodeError) as error:
            self.inbox.warn(f"Cannot connect to {host}:{port}: {error}", kind=f"connect {host}:{port}")
            self._report_end(link)

    def _make_server_link(self) -> StreamLink:
        return StreamLink(next(self._ids), LinkRole.SERVER, self)

    def _resume_reading(self) -> None:
        for link in list(self._links.values()):
            link.resume_reading()

    # -- events of connections, in the thread

    def accept_link(self, link: StreamLink) -> bool:
        """Add a new connection, and return whether the connection may stay open."""
        with self._lock:
            # the environment may have closed the connection before it was open
            if link.role is LinkRole.CLIENT:
                is_accepted = link.id in self._links
            else:
                client_count = sum(open_link.role is LinkRole.SERVER for open_link in self._links.values())
                is_accepted = self._server is not None and client_count < MAX_CLIENTS
                if is_accepted:
                    self._links[link.id] = link
        if is_accepted:
            self.inbox.add_event(
                ConnectionChange(link.role, link.id, is_connected=True, host=link.host, port=link.port)
            )
        # without a warning if the server was disabled in between
        elif link.role is LinkRole.SERVER and self._server is not None:
            self.inbox.warn(
                f"Client {link.host} is rejected: there are too many clients", kind="too many clients"
            )
        return is_accepted

    def report_loss(self, link: StreamLink, reason: str) -> None:
        """Report a lost connection with its reason, which may be empty."""
        if reason:
            self.inbox.warn(
                f"Connection {link.id} to {link.host}:{link.port} closed: {reason}", kind="closed"
            )
        self._report_end(link)

    def _report_end(self, link: StreamLink) -> None:
        """Report the end of a connection unless the environment closed it."""
        link.is_connected = False
        with self._lock:
            was_open = link.id in self._links
            # a client's link stays, so that `send` refuses its messages; an unknown id would be ignored
            if link.role is LinkRole.SERVER:
                self._links.pop(link.id, None)
        if was_open:
            self.inbox.add_event(ConnectionChange(link.role, link.id, is_connected=False))

    def receive_frame(self, link: StreamLink, frame: Frame) -> None:
        """Add the message of a frame from a connection to the inbox."""
        # protobuf_comm reports no address for messages from the server of a client
        host, port = (link.host, link.port) if link.role is LinkRole.SERVER else ("", 0)
        self._receive_message(link.role, link.id, host, port, frame)

    def _receive_message(self, role: LinkRole, link_id: int, host: str, port: int, frame: Frame) -> None:
        event = parse_message(self._types, frame, role, link_id, host, port, self.inbox.now_us())
        if event.message is None and role is LinkRole.PEER:
            self.inbox.warn(
                f"Failed to receive peer message from {host}:{port}: Deserialization fail: {event.problem}",
                kind=f"message for {link_id}",
            )
        else:
            self.inbox.add_event(event, size=len(frame.encoded_message))


def _make_crypter(secret: str, cipher: str) -> Crypter | None:
    return Crypter(secret, cipher) if secret and cipher else None


def _check_port(port: int) -> None:
    if port > _MAX_PORT:
        raise ProtobufError(f"there is no port {port}", hint="use a port from 1 to 65535")
