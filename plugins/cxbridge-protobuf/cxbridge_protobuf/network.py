"""Socket connections of one environment: a thread puts received messages into an inbox.

The thread of the environment calls the public methods. Rules: docs/evidence/protocol-protobuf.md.
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
from cxbridge_protobuf import frames
from cxbridge_protobuf.crypto import Crypter
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import Event, Inbox, Origin, Presence, Received
from cxbridge_protobuf.peer import MAX_PEER_BYTES, Peer
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.stream import StreamLink
from cxbridge_protobuf.types import MessageTypes

T = TypeVar("T")

MAX_CLIENTS: Final = 256  # limit of clients at a server

_TIMEOUT_S = 10  # seconds to wait for the thread, whose work never blocks
_ALL_INTERFACES = "*"
_MAX_PORT = 65535


class Network:
    """The server, clients and peers of an environment.

    :param types: the parser of messages.
    :param now_us: the clock for time stamps of messages.
    """

    def __init__(self, types: MessageTypes, settings: NetworkSettings, now_us: Callable[[], int]) -> None:
        self._settings = settings
        self._types = types
        self._inbox = Inbox(settings.max_waiting, now_us)
        self._ids = itertools.count(1)
        self._lock = threading.Lock()
        self._streams: dict[int, StreamLink] = {}
        self._peers: dict[int, Peer] = {}
        self._server: asyncio.Server | None = None
        self._thread: LoopThread | None = None

    # -- the environment's side

    def drain(self) -> list[Event]:
        """Return the events since the last call, and resume paused reading."""
        events, was_full = self._inbox.drain()
        if was_full:
            self._call(self._resume)
        return events

    def enable_server(self, port: int) -> None:
        """Listen for clients; ignored if a server exists or the port is below 1.

        :raises ProtobufError: if the port is unavailable.
        """
        if port <= 0 or self._server is not None:
            return
        listening = self._listen(port)

        async def start() -> asyncio.Server:
            return await asyncio.get_running_loop().create_server(self._accept, sock=listening)

        self._server = self._run(start())

    def disable_server(self) -> None:
        """Stop listening and close the connections of the server's clients."""
        server, self._server = self._server, None
        if server is not None:

            async def stop() -> None:
                server.close()

            self._run(stop())
            for link in self._take_streams(Origin.SERVER):
                self._call(link.close)

    def connect(self, host: str, port: int) -> int:
        """Start a connection to a server; return the client's id, or 0 for a port below 1."""
        if port <= 0:
            return 0
        link = StreamLink(next(self._ids), Origin.CLIENT, self)
        with self._lock:
            self._streams[link.id] = link
        self._spawn(self._connect(link, host, port))
        return link.id

    def disconnect(self, link_id: int) -> None:
        """Close a connection of a client or the server; unknown ids are ignored."""
        with self._lock:
            link = self._streams.pop(link_id, None)
        if link is not None:
            self._call(link.close)

    def create_peer(self, address: str, send_port: int, recv_port: int, secret: str, cipher: str) -> int:
        """Create a peer that sends to an address and receives on a port; return its id.

        :param recv_port: the receiving port; below 1 for the same port as ``send_port``.
        :param secret: the secret of encryption; empty for plain messages.
        :returns: 0 if ``send_port`` is below 1.
        :raises ProtobufError: if the port or the cipher is unavailable.
        """
        if send_port <= 0:
            return 0
        for port in (send_port, recv_port):
            _check_port(port)
        crypter = self._crypter(secret, cipher)
        peer = Peer(
            next(self._ids), address, send_port, self._settings.frame_version, self._received, self._inbox
        )
        peer.crypter = crypter
        self._run(peer.open(recv_port if recv_port > 0 else send_port))
        with self._lock:
            self._peers[peer.id] = peer
        return peer.id

    def destroy_peer(self, peer_id: int) -> None:
        """Close a peer; unknown ids are ignored."""
        with self._lock:
            peer = self._peers.pop(peer_id, None)
        if peer is not None:
            self._run(peer.close())

    def setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        """Encrypt a peer's further messages; an empty secret or cipher ends encryption."""
        peer = self._peers.get(peer_id)
        if peer is not None:
            peer.crypter = self._crypter(secret, cipher)

    def send(self, link_id: int, frame: Frame) -> None:
        """Send over a connection or a peer; unknown ids are ignored.

        :raises ProtobufError: if the connection is not open, or the message is too long.
        """
        link = self._streams.get(link_id)
        if link is None:
            self.broadcast(link_id, frame)
            return
        if len(frame.data) > self._settings.max_message_size:
            raise ProtobufError("Serialized message too big")
        if not link.connected:
            raise ProtobufError("Cannot send while not connected")
        self._call(link.write, frames.encode(frame, self._settings.frame_version))

    def broadcast(self, peer_id: int, frame: Frame) -> None:
        """Send over a peer; unknown ids are ignored.

        :raises ProtobufError: if the message is too long.
        """
        peer = self._peers.get(peer_id)
        if peer is None:
            return
        if len(frame.data) > MAX_PEER_BYTES:
            raise ProtobufError("Serialized message too big")
        self._call(peer.send, frame)

    def close(self) -> None:
        """Close all connections and end the thread; the network is unusable afterwards."""
        self.disable_server()
        for link in self._take_streams(None):
            self._call(link.close)
        for peer_id in list(self._peers):
            self.destroy_peer(peer_id)
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.close()

    def _crypter(self, secret: str, cipher: str) -> Crypter | None:
        if not secret or not cipher:
            return None
        if self._settings.frame_version == 1:
            raise ProtobufError("frames of version 1 cannot be encrypted")
        return Crypter(secret, cipher)

    def _listen(self, port: int) -> socket.socket:
        _check_port(port)
        address = self._settings.server_address
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

    def _take_streams(self, origin: Origin | None) -> list[StreamLink]:
        """Remove and return connections; all if no origin is given."""
        with self._lock:
            links = [link for link in self._streams.values() if origin is None or link.origin is origin]
            for link in links:
                del self._streams[link.id]
        return links

    # -- the thread

    def _start_thread(self) -> LoopThread:
        """Return the thread, started by the first call: many environments have no connections."""
        if self._thread is None:
            self._thread = LoopThread("clips-protobuf")
        return self._thread

    def _run(self, work: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine in the thread and wait for its result."""
        return self._start_thread().spawn(work).result(_TIMEOUT_S)

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        """Start a coroutine in the thread."""
        self._start_thread().spawn(work)

    def _call(self, function: Callable[..., object], *arguments: object) -> None:
        """Call a function in the thread; without a thread there are no connections."""
        if self._thread is not None:
            self._thread.call(function, *arguments)

    async def _connect(self, link: StreamLink, host: str, port: int) -> None:
        try:
            await asyncio.get_running_loop().create_connection(lambda: link, host, port)
        except (OSError, OverflowError, UnicodeError) as error:
            self._inbox.warn(f"Cannot connect to {host}:{port}: {error}", kind=f"connect {host}:{port}")
            self._report_end(link)

    def _accept(self) -> StreamLink:
        return StreamLink(next(self._ids), Origin.SERVER, self)

    def _resume(self) -> None:
        for link in list(self._streams.values()):
            link.resume()

    # -- events of connections, in the thread

    @property
    def settings(self) -> NetworkSettings:
        return self._settings

    @property
    def inbox(self) -> Inbox:
        return self._inbox

    def accept(self, link: StreamLink) -> bool:
        """Add a new connection; return whether it may stay."""
        with self._lock:
            # the environment may have closed the connection in the meantime
            if link.origin is Origin.CLIENT:
                accepted = link.id in self._streams
            else:
                clients = sum(stream.origin is Origin.SERVER for stream in self._streams.values())
                accepted = self._server is not None and clients < MAX_CLIENTS
                if accepted:
                    self._streams[link.id] = link
        if accepted:
            self._inbox.put(Presence(link.origin, link.id, connected=True, host=link.host, port=link.port))
        elif link.origin is Origin.SERVER:
            self._inbox.warn(f"Client {link.host} is sent away, there are too many", kind="many")
        return accepted

    def lost(self, link: StreamLink, reason: str) -> None:
        """Report a lost connection with its reason."""
        if reason:
            self._inbox.warn(
                f"Connection {link.id} to {link.host}:{link.port} closed: {reason}", kind="closed"
            )
        self._report_end(link)

    def _report_end(self, link: StreamLink) -> None:
        """Report the end of a connection unless the environment closed it."""
        link.connected = False
        with self._lock:
            was_open = link.id in self._streams
            if link.origin is Origin.SERVER:
                self._streams.pop(link.id, None)
        if was_open:
            self._inbox.put(Presence(link.origin, link.id, connected=False))

    def received(self, link: StreamLink, frame: Frame) -> None:
        """Process a frame from a connection."""
        # protobuf_comm reports no address for messages from the server of a client
        host, port = (link.host, link.port) if link.origin is Origin.SERVER else ("", 0)
        self._received(link.origin, link.id, host, port, frame)

    def _received(self, origin: Origin, link_id: int, host: str, port: int, frame: Frame) -> None:
        message, problem = None, ""
        try:
            message = self._types.parse(frame)
        except ProtobufError as error:
            problem = error.message
        if message is None and origin is Origin.PEER:
            self._inbox.warn(
                f"Failed to receive peer message from {host}:{port}: Deserialization fail: {problem}",
                kind=f"message for {link_id}",
            )
            return
        at_us = self._inbox.now_us()
        self._inbox.put(
            Received(origin, link_id, host, port, frame.component, frame.type, at_us, message, problem),
            size=len(frame.data),
        )


def _check_port(port: int) -> None:
    if port > _MAX_PORT:
        raise ProtobufError(f"there is no port {port}", hint="1 to 65535")
