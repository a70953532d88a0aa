"""A broadcast peer, which sends to a UDP address and receives on a UDP port.

The methods run in the thread of the network.
"""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from typing import Final

from cxbridge.errors import ProtobufError
from cxbridge.listening import LOOPBACK, is_loopback
from cxbridge_protobuf import frames
from cxbridge_protobuf.crypto import Crypter
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import Inbox, Origin

# the limit of a message: the peers of protobuf_comm receive into a buffer of this size
MAX_PEER_BYTES: Final = 1024

_RETRY_S = 2.0  # seconds between two attempts to resolve the host
# frames that wait until the host is resolved; more frames displace the oldest frames
_MAX_WAITING_FRAMES = 64

ReceiveFrame = Callable[[Origin, int, str, int, Frame], None]


class Peer(asyncio.DatagramProtocol):
    """A peer.

    :param peer_id: the id of the peer in the environment.
    :param address: the IPv4 address or the name of the host to which the peer sends.
    :param version: the version of frames.
    :param receive: called with the sender and the frame of each received datagram.
    :param inbox: gets warnings; while the inbox is full, datagrams are dropped.
    """

    def __init__(
        self, peer_id: int, address: str, port: int, version: int, receive: ReceiveFrame, inbox: Inbox
    ) -> None:
        self.id: Final = peer_id
        self.crypter: Crypter | None = None
        self._address = address
        self._port = port
        self._version = version
        self._receive = receive
        self._inbox = inbox
        self._transport: asyncio.DatagramTransport | None = None
        self._target: tuple[str, int] | None = None
        self._own_address: tuple[str, int] | None = None
        self._waiting_frames: deque[Frame] = deque(maxlen=_MAX_WAITING_FRAMES)
        self._resolution_task: asyncio.Task[None] | None = None
        self._closed = asyncio.Event()

    async def open(self, port: int) -> None:
        """Open the receiving port and start resolving the target host.

        :raises ProtobufError: if the port is unavailable.
        """
        with ExitStack() as cleanup:
            udp_socket = cleanup.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            try:
                udp_socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                udp_socket.bind((LOOPBACK if is_loopback(self._address) else "", port))
            except OSError as error:
                raise ProtobufError(f"Cannot receive on UDP port {port}: {error.strerror}") from None
            loop = asyncio.get_running_loop()
            self._transport, _ = await loop.create_datagram_endpoint(lambda: self, sock=udp_socket)
            cleanup.pop_all()
        self._resolution_task = asyncio.create_task(self._resolve_host(port))

    async def close(self) -> None:
        """Close the socket, and wait until the port is available again."""
        if self._resolution_task is not None:
            self._resolution_task.cancel()
        if self._transport is not None:
            self._transport.close()
            await self._closed.wait()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - a protocol's signature
        self._closed.set()

    def send(self, frame: Frame) -> None:
        """Send a frame, at once or after the host is resolved."""
        if self._target is None or self._transport is None:
            self._waiting_frames.append(frame)
            return
        crypter = self.crypter
        if crypter is None:
            data = frames.encode_frame(frame, self._version)
        else:
            data = frames.add_header(crypter.cipher_number, crypter.encrypt(frames.encode_payload(frame)))
        self._transport.sendto(data, self._target)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Receive a frame from a further peer."""
        host, port = addr
        if addr == self._own_address:
            return  # a broadcast reaches its sender, too
        if self._inbox.is_full:
            self._warn(addr, "dropped, because the rules do not keep up with the messages")
            return
        try:
            frame = self._decode_datagram(data)
        except ProtobufError as error:
            self._warn(addr, error.message)
            return
        self._receive(Origin.PEER, self.id, host, port, frame)

    def error_received(self, exc: Exception) -> None:
        self._inbox.warn(f"Failed to send peer message: {exc}", kind=f"send {self.id}")

    def _decode_datagram(self, data: bytes) -> Frame:
        cipher_number, payload = frames.decode_datagram(data, self._version)
        crypter = self.crypter
        if crypter is None:
            if cipher_number != frames.NO_CIPHER:
                raise ProtobufError("Received encrypted message but encryption is disabled")
        elif cipher_number == frames.NO_CIPHER:
            raise ProtobufError("Received plain text message but encryption is enabled")
        else:
            payload = crypter.decrypt(cipher_number, payload)
        return frames.decode_payload(payload)

    def _warn(self, addr: tuple[str, int], problem: str) -> None:
        self._inbox.warn(
            f"Failed to receive peer message from {addr[0]}:{addr[1]}: {problem}", kind=f"frame for {self.id}"
        )

    async def _resolve_host(self, port: int) -> None:
        """Resolve the host, with further attempts after failures, then send the waiting frames."""
        loop = asyncio.get_running_loop()
        while self._target is None:
            try:
                addresses = await loop.getaddrinfo(
                    self._address, self._port, family=socket.AF_INET, type=socket.SOCK_DGRAM
                )
                self._own_address = (_find_source_address(addresses[0][4][0]), port)
                self._target = (str(addresses[0][4][0]), self._port)
            except (OSError, UnicodeError):
                self.error_received(ProtobufError(f"cannot resolve the host {self._address}, retrying"))
                await asyncio.sleep(_RETRY_S)
        while self._waiting_frames:
            self.send(self._waiting_frames.popleft())


def _find_source_address(address: str | int) -> str:
    """Return the local address from which datagrams to another address are sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        try:
            probe.connect((address, 9))  # chooses a route and sends nothing; the port makes no difference
        except OSError:
            return ""  # an unreachable address sends no broadcast back
        return str(probe.getsockname()[0])
