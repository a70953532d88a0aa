"""A TCP connection of a server or a client, whose methods run in the thread of the network."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Final, Protocol

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame, StreamDecoder
from cxbridge_protobuf.inbox import Inbox, LinkRole

MAX_MESSAGE_BYTES: Final = 1 << 20  # the maximum size of a message
MAX_OUTBOUND_BYTES: Final = 8 << 20  # the maximum number of bytes that wait to be sent over a connection

_MAPPED_PREFIX = "::ffff:"  # the prefix of an IPv4 address at a socket for IPv4 and IPv6
_MESSAGE_HEADER_BYTES = 4  # the message header, which the size in a frame includes
_READ_BYTES = 65536  # chosen freely: reads are repeated until the buffer is empty


class LinkOwner(Protocol):
    """The receiver of a connection's events."""

    @property
    def inbox(self) -> Inbox:
        """The queue of received messages; reading pauses while the queue is full."""

    def accept_link(self, link: StreamLink) -> bool:
        """Add a new connection, and return whether the connection may stay open."""

    def receive_frame(self, link: StreamLink, frame: Frame) -> None:
        """Handle a frame that a connection has received."""

    def report_loss(self, link: StreamLink, reason: str) -> None:
        """Report a lost connection.

        :param reason: why this program aborted the connection; empty after any other end.
        """


class StreamLink(asyncio.Protocol):
    """A connection.

    :param link_id: the id of the connection in the environment.
    :param role: whether the connection belongs to a client or to the server of the environment.
    :param owner: gets the events of the connection.
    :ivar host: the address of the opposite end; empty before the connection is open.
    :ivar port: the port of the opposite end; 0 before the connection is open.
    """

    _transport: asyncio.Transport  # set when the connection is open

    def __init__(self, link_id: int, role: LinkRole, owner: LinkOwner) -> None:
        self.id: Final = link_id
        self.role: Final = role
        self.is_connected = False
        self.host = ""
        self.port = 0
        self._owner = owner
        self._decoder = StreamDecoder(MAX_MESSAGE_BYTES + _MESSAGE_HEADER_BYTES)
        self._abort_reason = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Report the connection to the owner, and abort the connection if the owner rejects it."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        # an address of IPv6 has two more items; asyncio has None for a connection that is already lost
        self.host, self.port = (transport.get_extra_info("peername") or ("", 0))[:2]
        self.host = self.host.removeprefix(_MAPPED_PREFIX)
        # set before accept_link(): afterwards the environment may send at once
        self.is_connected = True
        if not self._owner.accept_link(self):
            self.is_connected = False
            transport.abort()

    def data_received(self, data: bytes) -> None:
        """Decode received bytes; abort the connection for invalid bytes, pause reading for a full inbox."""
        if not self.is_connected:
            return
        try:
            for frame in self._decoder.feed(data):
                self._owner.receive_frame(self, frame)
        except ProtobufError as error:
            self._abort(error.message)
            return
        if self._owner.inbox.record_if_full():
            self._transport.pause_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Decode the bytes that arrived before a failed send, then report the loss.

        A connection that the owner rejected or :meth:`close` closed is not reported.
        """
        if exc is not None and self.is_connected:
            self._read_remaining()
        was_connected, self.is_connected = self.is_connected or bool(self._abort_reason), False
        if was_connected:
            self._owner.report_loss(self, self._abort_reason)

    def _read_remaining(self) -> None:
        """Decode the bytes that are still in the buffer of the operating system.

        A program that closes a connection with unread bytes resets the connection. Then our next send fails,
        and asyncio closes the connection although the buffer still has bytes for us.
        """
        # a duplicate, since the socket of asyncio has no recv(); BlockingIOError ends the buffered bytes, and
        # any other OSError means that the rest is lost
        with suppress(OSError), self._transport.get_extra_info("socket").dup() as unread:
            unread.setblocking(False)
            while self.is_connected and (data := unread.recv(_READ_BYTES)):
                self.data_received(data)

    def resume_reading(self) -> None:
        """Read again after a pause for a full inbox."""
        if self.is_connected:
            self._transport.resume_reading()

    def write(self, data: bytes) -> None:
        """Send bytes, and abort the connection if the receiver reads too slowly."""
        if not self.is_connected:
            return
        self._transport.write(data)
        if self._transport.get_write_buffer_size() > MAX_OUTBOUND_BYTES:
            self._abort("the receiver reads too slowly")

    def close(self) -> None:
        """Send the waiting bytes, then close the connection without a report to the owner."""
        if self.is_connected:
            self._transport.close()
        self.is_connected = False

    def _abort(self, reason: str) -> None:
        self.is_connected = False
        self._abort_reason = reason
        self._transport.abort()
