"""A TCP connection of a server or a client, in the network's thread."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Final, Protocol

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame, StreamDecoder
from cxbridge_protobuf.inbox import Inbox, Origin
from cxbridge_protobuf.settings import NetworkSettings

_MAPPED = "::ffff:"  # the prefix of an IPv4 address at a socket for both versions of IP
_HEADER = 4  # bytes of the message header, which counts as part of a frame's size
_CHUNK = 65536  # bytes of one read


class LinkOwner(Protocol):
    """The receiver of a connection's events."""

    @property
    def settings(self) -> NetworkSettings:
        """The limits of frames and of waiting bytes."""

    @property
    def inbox(self) -> Inbox:
        """The queue of received messages; reading pauses while it is full."""

    def accept(self, link: StreamLink) -> bool:
        """Add a new connection; return whether it may stay."""

    def received(self, link: StreamLink, frame: Frame) -> None:
        """Process a frame."""

    def lost(self, link: StreamLink, reason: str) -> None:
        """Report a lost connection with its reason."""


class StreamLink(asyncio.Protocol):
    """A connection.

    :param link_id: the id of the connection in the environment.
    :param origin: whether the connection belongs to a client or to the server of the environment.
    :param network: gets the events of the connection.
    """

    def __init__(self, link_id: int, origin: Origin, network: LinkOwner) -> None:
        self.id: Final = link_id
        self.origin: Final = origin
        self.connected = False
        self.host = ""
        self.port = 0
        settings = network.settings
        self._network = network
        self._decoder = StreamDecoder(settings.max_message_size + _HEADER, settings.frame_version)
        self._transport: asyncio.Transport | None = None
        self._reason = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Announce the connection; abort it if the network refuses it."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.host, self.port = transport.get_extra_info("peername", ("", 0))[:2]
        self.host = self.host.removeprefix(_MAPPED)
        # before accept(), after which the environment may send at once
        self.connected = True
        if not self._network.accept(self):
            self.connected = False
            transport.abort()

    def data_received(self, data: bytes) -> None:
        """Process received bytes; close the connection if they are invalid."""
        if not self.connected or self._transport is None:
            return
        try:
            for frame in self._decoder.feed(data):
                self._network.received(self, frame)
        except ProtobufError as error:
            self._drop(error.message)
            return
        if self._network.inbox.full:
            self._transport.pause_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Process bytes received before a failed send, then report the end."""
        if exc is not None and self.connected:
            self._read_remaining()
        was_connected, self.connected = self.connected or bool(self._reason), False
        if was_connected:
            self._network.lost(self, self._reason)

    def _read_remaining(self) -> None:
        """Read the bytes that are still in the system's buffer.

        A peer that closes a connection with unread bytes resets it. The next send then fails, and asyncio
        drops the connection with our unread bytes still buffered.
        """
        assert self._transport is not None
        with suppress(OSError), self._transport.get_extra_info("socket").dup() as unread:
            unread.setblocking(False)
            while self.connected and (data := unread.recv(_CHUNK)):
                self.data_received(data)

    def resume(self) -> None:
        """Continue to read, after a full inbox."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.resume_reading()

    def write(self, data: bytes) -> None:
        """Send bytes; drop the connection if the other side reads too slowly."""
        if not self.connected or self._transport is None:
            return
        self._transport.write(data)
        if self._transport.get_write_buffer_size() > self._network.settings.max_outbound:
            self._drop("it does not read what it is sent")

    def close(self) -> None:
        """Send waiting bytes and close without a notification."""
        self.connected = False
        if self._transport is not None:
            self._transport.close()

    def _drop(self, reason: str) -> None:
        assert self._transport is not None
        self.connected = False
        self._reason = reason
        self._transport.abort()
