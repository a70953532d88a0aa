"""The port of an instance on Fawkes' blackboard: block, counters, listeners.

Fawkes sends a client its own writes back (the echo), reports a changing write twice (REFRESHED, then
CHANGED), and numbers the messages itself. The port hides all three, so that an instance works as on a local
blackboard.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard, OpenRequest
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import Audience, EventKind
from cxbridge.blackboard.port import BoardPort
from cxbridge.blackboard.publications import REFUSED, SENT, emit_message, emit_write
from cxbridge.events import EventBus, Publication
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.message import ClosedPort, InstanceIdentity
from cxbridge.interfaces.message_ids import MESSAGE_ID_MASK, NO_MESSAGE, read_id
from cxbridge_fawkes.network.client.requests import RequestSender
from cxbridge_fawkes.network.messages.blackboard import OpenSuccess, WireMessage, pack_data_frame

MAX_COUNTED_READERS: Final = 0xFFFF
"""The maximum plausible number of readers, which Fawkes counts in 16 bits."""

UNKNOWN_SERIAL: Final = UUID(int=0)
"""The serial of an unknown writer or sender: it opened the interface before this client connected."""

# more events than the fastest writer causes in a second, so that only a listener that hangs misses updates
MAX_WAITING_EVENTS: Final = 20_000
"""The maximum number of waiting data events of a port; further data events are dropped."""

_STAMP_SIZE: Final = STAMP.size  # a block begins with the time stamp

DataEvents = tuple[tuple[EventKind, Audience], ...]
"""Events of data, with the listeners at the time of the event. Later listeners read the data themselves."""


class RemotePort(BoardPort):
    """The port of one instance, with the known state of the remote interface.

    The receiving thread updates the port, any thread reads the instance.

    :param requests: sends data and messages.
    :param emitter: emits writes and messages on the event bus.
    :param mem_serial: the number of the interface in this client.
    :param reply: the server's reply to the opening.
    """

    def __init__(
        self,
        board: BlackBoard,
        requests: RequestSender,
        emitter: PublicationEmitter,
        request: OpenRequest,
        mem_serial: int,
        reply: OpenSuccess,
    ) -> None:
        super().__init__(board, request.interface_class, request.id, mem_serial)
        self._requests: Final = requests
        self._emitter: Final = emitter
        self.request: Final = request
        self.serial: UUID | None = reply.serial
        """The serial of the instance at the server; None while the instance is not open there."""
        self.last_written_block: bytes | None = None
        """The last written block, to be repeated after a reconnection; None before the first write."""
        self.waiting_event_count = 0
        """The number of queued data events, counted by the receiver."""
        self._changed_may_follow = False  # the last frame was REFRESHED, whose CHANGED may follow
        self._last_id = 0  # the last id that the instance has assigned
        self._unsent_count = 0  # the number of assigned ids that the server has not counted
        self._has_writer = reply.has_writer
        self._num_readers = reply.num_readers
        if any(reply.block):  # a block of zeros is that of an interface without a write
            self._store_received(reply.block, changed=True)
        self.instance: Final = request.make_instance(self, reply.serial)

    def receive(self, block: bytes, *, changed: bool) -> DataEvents:
        """Store a received block; return its events.

        A REFRESHED and its CHANGED count as one write, as does a CHANGED without REFRESHED.

        :param changed: whether the frame was CHANGED instead of REFRESHED.
        """
        if self.instance.is_writer:
            return ()  # the echo of this client's write, which may be older than the present data
        with self._lock:
            snapshot = self.snapshot
            completes_pair = changed and self._changed_may_follow and block == snapshot.block
            self._changed_may_follow = not changed
            if completes_pair:
                # the REFRESHED had the same values as before, and so did not count as a change
                if snapshot.last_changed != snapshot.version:
                    self._replace_snapshot(block, stamped=False, changed=True)
                return self._make_events(EventKind.DATA_CHANGED)
            self._store_received(block, changed=changed)
            if changed:
                return self._make_events(EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED)
            return self._make_events(EventKind.DATA_REFRESHED)

    def _make_events(self, *kinds: EventKind) -> DataEvents:
        """Return events for the present listeners. The caller holds the lock."""
        return tuple((kind, self.listeners.find_audience(kind)) for kind in kinds)

    def count_instance(self, kind: EventKind) -> None:
        """Count an added or removed instance."""
        if kind in (EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED):
            self._has_writer = kind is EventKind.WRITER_ADDED
        else:
            change = 1 if kind is EventKind.READER_ADDED else -1
            self._num_readers = max(self._num_readers + change, 0)

    def lose_connection(self) -> bool:
        """Reset the state at the server; return whether the interface had a writer."""
        had_writer = self._has_writer
        self.serial = None
        self._has_writer = False
        self._num_readers = 0
        self._changed_may_follow = False
        return had_writer

    def reopen(self, reply: OpenSuccess) -> DataEvents:
        """Store the new serial and, for a reader, the block; return the events of the block."""
        self._has_writer = reply.has_writer
        self._num_readers = reply.num_readers
        self.instance.adopt_serial(reply.serial)
        self._unsent_count = self._last_id  # the server counts from 1 again
        self.serial = reply.serial
        if self.instance.is_writer:
            return ()
        with self._lock:
            if reply.block == self.snapshot.block:
                return ()
            self._store_received(reply.block, changed=True)
            return self._make_events(EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED)

    def _store_received(self, block: bytes, *, changed: bool) -> None:
        """Store a received block; the caller holds the lock or is the constructor."""
        # a client that opens an interface during a write gets the values by REFRESHED without CHANGED
        changed = changed or block[_STAMP_SIZE:] != self.snapshot.block[_STAMP_SIZE:]
        self._replace_snapshot(block, stamped=True if changed else None, changed=changed)

    def publish(
        self,
        writer: InstanceIdentity,  # noqa: ARG002 - always the instance of this port
        block: bytes | bytearray,
        stamped: bool | None,
        changed: bool,
    ) -> int:
        """Send the writer's block and notify the listeners, see :class:`~cxbridge.interfaces.message.Port`.

        :raises ConnectionLostError: if the block cannot be sent.
        """
        written_block = bytes(block)
        frame = pack_data_frame(self._require_serial().bytes, written_block, changed=changed)
        self._requests.send(frame, must_arrive=True)
        self.last_written_block = written_block
        with self._lock:
            version = self._replace_snapshot(written_block, stamped, changed).version
            # listeners that register later read the data and are not notified
            audience = self.listeners.data_audience
        self._emitter.emit_write(self, written_block)
        if audience is not None:
            self.listeners.notify_data(audience, changed)
        return version

    def next_id(self, last_id: int) -> int:
        """Return the next id, see :class:`~cxbridge.interfaces.message.Port`."""
        # the server counts the received messages, so the client cannot skip an id that the interface shows; a
        # caller that needs a different id sends messages without effect first, see exclusive_control
        return (last_id + 1) & MESSAGE_ID_MASK

    def next_id_is_stale(self, last_id: int) -> bool:
        """Return whether the server's next id is 0, or the id that the interface shows."""
        server_id = (last_id + 1 - self._unsent_count) & MESSAGE_ID_MASK
        return server_id in (NO_MESSAGE, read_id(self.snapshot.block, self._id_offset))

    def transmit(self, sender: Interface, message: Message) -> None:
        """Send an addressed message; its id becomes the server's id.

        :raises NoWriterError: if the interface has no writer, as far as known.
        :raises ConnectionLostError: if the message cannot be sent.
        """
        # Fawkes counts the received messages and ignores their ids, so ids of unsent messages must be
        # subtracted
        self._last_id = message.id
        source = message.source_id or sender.serial
        try:
            if not self._has_writer and self.serial is not None:
                self._board.refuse_message(sender, message)
            message_id = (message.id - self._unsent_count) & MESSAGE_ID_MASK
            wire_message = WireMessage(
                serial=self._require_serial(),
                source=source,
                type=message.type,
                id=message_id,
                hops=message.hops,
                block=message.to_bytes(),
            )
            self._requests.send(wire_message.to_bytes(), must_arrive=True)
        except BlackBoardError:
            self._unsent_count += 1
            self._emitter.emit_message(self, message, REFUSED)
            raise
        message.address(message_id, self.mem_serial, sender.serial)
        message.mark_enqueued(self.now_us())
        self._emitter.emit_message(self, message, SENT)

    def _require_serial(self) -> UUID:
        """Return the serial at the server.

        :raises ConnectionLostError: if the instance is not open at the server.
        """
        serial = self.serial
        if serial is None:
            raise self._requests.make_unavailable_error()
        return serial

    def has_writer(self) -> bool:
        return self._has_writer

    def writer_owner(self) -> str:
        """Return the empty text, because the wire does not carry owners."""
        return ""

    def reader_owners(self) -> tuple[str, ...]:
        """Return an empty text per reader, because the wire carries only their number."""
        return anonymous_owners(self._num_readers)

    def reader_owner(self, serial: str) -> str:  # noqa: ARG002 - the signature of a port
        """Return the empty text, because the wire does not carry owners."""
        return ""


def anonymous_owners(count: int) -> tuple[str, ...]:
    """Return an empty text for each reader, whose owner is unknown; at most `MAX_COUNTED_READERS` texts."""
    return ("",) * min(count, MAX_COUNTED_READERS)


class PublicationEmitter:
    """Emits each write once, even if several instances receive it.

    :param bus: receives the events; without it, no event is emitted.
    :param now_us: returns the time.
    :param list_ports: returns the ports of all open instances, oldest first.
    """

    def __init__(
        self, bus: EventBus | None, now_us: Callable[[], int], list_ports: Callable[[], Iterable[RemotePort]]
    ) -> None:
        self._bus: Final = bus
        self._now_us: Final = now_us
        self._list_ports: Final = list_ports

    def emit_write(self, port: RemotePort, block: bytes) -> None:
        """Emit a written or received block if the port is the reporting port of its interface."""
        bus = self._bus
        if bus is None or not bus.wants(Publication) or not self._is_reporting_port(port):
            return

        def read_values() -> dict[str, Any]:
            instance = port.interface_class(
                ClosedPort(port.uid, UNKNOWN_SERIAL),
                id=port.id,
                owner="",
                serial=UNKNOWN_SERIAL,
                writer=False,
            )
            instance.set_from_chunk(block)
            return instance.as_dict()

        emit_write(bus, self._now_us(), port.uid, port.hash, block, read_values)

    def emit_message(self, port: RemotePort, message: Message, outcome: str) -> None:
        """Emit a received message, or a message that this client sends, with its outcome."""
        # the server sends back a message to a writer of this client, which is emitted then with its outcome
        comes_back = outcome == SENT and any(
            local_port.uid == port.uid and local_port.instance.is_writer for local_port in self._list_ports()
        )
        if not comes_back:
            sender = "" if port.instance.is_writer else port.instance.owner
            emit_message(self._bus, self._now_us(), port.uid, sender, message, outcome)

    def _is_reporting_port(self, port: RemotePort) -> bool:
        """Return whether the port is the reporting port of its interface: the writer's, else the oldest."""
        ports = [local_port for local_port in self._list_ports() if local_port.uid == port.uid]
        writers = [local_port for local_port in ports if local_port.instance.is_writer]
        return bool(ports) and (writers or ports)[0] is port
