"""A broadcast peer, which sends to a UDP address and receives on a UDP port.

The methods run in the thread of the network.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from contextlib import ExitStack
from typing import Final

from cxbridge.errors import ProtobufError
from cxbridge.listening import LOOPBACK, is_loopback
from cxbridge_protobuf import frames
from cxbridge_protobuf.crypto import Crypter
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import Inbox, LinkRole

# the limit of a message: the peers of protobuf_comm receive into a buffer of this size
MAX_PEER_BYTES: Final = 1024

# gets the role, the id of the peer, host and port of the sender, and the frame
ReceiveFrame = Callable[[LinkRole, int, str, int, Frame], None]


class Peer(asyncio.DatagramProtocol):
    """An end of protobuf_comm's broadcast: sends to one address, and receives from all hosts.

    A peer that sends to this machine only also receives from this machine only.

    :param peer_id: the id of the peer in the environment.
    :param address: the IPv4 address or the name of the host to which the peer sends.
    :param send_port: the port of that host.
    :param crypter: encrypts the messages; None for unencrypted messages.
    :param receive_frame: called with the sender and the frame of each valid datagram from another peer.
    :param inbox: gets warnings; while the inbox is full, datagrams are dropped.
    """

    _transport: asyncio.DatagramTransport  # set by open()

    def __init__(
        self,
        peer_id: int,
        address: str,
        send_port: int,
        crypter: Crypter | None,
        receive_frame: ReceiveFrame,
        inbox: Inbox,
    ) -> None:
        self.id: Final = peer_id
        self.crypter = crypter
        self._address = address
        self._send_port = send_port
        self._receive_frame = receive_frame
        self._inbox = inbox
        self._closed = asyncio.Event()

    async def open(self, recv_port: int) -> None:
        """Resolve the target host, and open the receiving port.

        :raises ProtobufError: if the host is unknown or the port is unavailable.
        """
        loop = asyncio.get_running_loop()
        try:
            addresses = await loop.getaddrinfo(
                self._address, None, family=socket.AF_INET, type=socket.SOCK_DGRAM
            )
        except (OSError, UnicodeError):
            raise ProtobufError(f"cannot resolve the host {self._address}") from None
        (*_, (host, *_)), *_ = addresses  # the socket address is the last item of each result
        self._target_address = (str(host), self._send_port)
        self._own_address = (_find_source_address(str(host)), recv_port)
        with ExitStack() as cleanup:
            udp_socket = cleanup.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            try:
                udp_socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                # a peer that sends to this machine only is not open to other machines
                udp_socket.bind((LOOPBACK if is_loopback(self._address) else "", recv_port))
            except OSError as error:
                raise ProtobufError(f"Cannot receive on UDP port {recv_port}: {error.strerror}") from None
            self._transport, _ = await loop.create_datagram_endpoint(lambda: self, sock=udp_socket)
            cleanup.pop_all()  # from here on, the transport owns the socket

    async def close(self) -> None:
        """Close the socket, and wait until the port is available again."""
        self._transport.close()
        await self._closed.wait()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - a protocol's signature
        self._closed.set()

    def send(self, frame: Frame) -> None:
        crypter = self.crypter
        if crypter is None:
            datagram = frames.encode_frame(frame)
        else:
            datagram = frames.add_header(crypter.cipher_number, crypter.encrypt(frames.encode_payload(frame)))
        self._transport.sendto(datagram, self._target_address)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Receive a frame from another peer, or warn about an invalid datagram."""
        host, port = addr
        if addr == self._own_address:
            return  # a broadcast reaches its sender, too
        if self._inbox.record_if_full():
            self._warn(host, port, "dropped, because the rules do not keep up with the messages")
            return
        try:
            frame = self._decode_datagram(data)
        except ProtobufError as error:
            self._warn(host, port, error.message)
            return
        self._receive_frame(LinkRole.PEER, self.id, host, port, frame)

    def error_received(self, exc: Exception) -> None:
        self._inbox.warn(f"Failed to send peer message: {exc}", kind=f"send {self.id}")

    def _decode_datagram(self, datagram: bytes) -> Frame:
        """Return the frame of a datagram.

        :raises ProtobufError: if the datagram is invalid, or if only one side encrypts.
        """
        cipher_number, payload = frames.decode_datagram(datagram)
        crypter = self.crypter
        if crypter is None:
            if cipher_number != frames.NO_CIPHER:
                raise ProtobufError("Received encrypted message but encryption is disabled")
        elif cipher_number == frames.NO_CIPHER:
            raise ProtobufError("Received plain text message but encryption is enabled")
        else:
            payload = crypter.decrypt(cipher_number, payload)
        return frames.decode_payload(payload)

    def _warn(self, host: str, port: int, problem: str) -> None:
        self._inbox.warn(
            f"Failed to receive peer message from {host}:{port}: {problem}", kind=f"frame for {self.id}"
        )


def _find_source_address(address: str) -> str:
    """Return the local address from which datagrams to an address are sent; empty if there is no route."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        try:
            probe.connect((address, 9))  # chooses a route and sends nothing; the port makes no difference
        except OSError:
            return ""  # an unreachable address sends no broadcast back
        source_address, _port = probe.getsockname()
        return str(source_address)
