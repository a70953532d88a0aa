"""The copy of an interface at a client; the port of the client's instances.

The receiving thread updates it, the threads of the instances use it, and the dispatcher's thread notifies its
listeners. The lock guards the copy.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Protocol
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import InvalidInstanceError, QueueFullError
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import DataAudience, EventKind
from cxbridge.blackboard.port import BoardPort
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.wire.codec import ChangeKind, ResultCode
from cxbridge.blackboard.zmq.wire.dataframes import DeliverBody
from cxbridge.blackboard.zmq.wire.messages import receive_message
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.message import OpenedBlock

_EVENTS: Final = {
    ChangeKind.READER_ADDED: EventKind.READER_ADDED,
    ChangeKind.READER_REMOVED: EventKind.READER_REMOVED,
    ChangeKind.WRITER_ADDED: EventKind.WRITER_ADDED,
    ChangeKind.WRITER_REMOVED: EventKind.WRITER_REMOVED,
}


class ZmqUplink(Protocol):
    """Sends the writes and messages of a copy to the server."""

    def write(
        self, port: InterfaceCopy, serial: UUID, stamped: bool | None, changed: bool, block: bytes
    ) -> None:
        """Send a write, or keep it for later."""

    def send_message(self, sender: Interface, message: Message) -> None:
        """Send a message and wait for its outcome."""

    def note_skipped(self) -> None:
        """Count a conflated update."""


@dataclass(slots=True)
class Member:
    """An open instance of the interface, at any client."""

    owner: str
    writer: bool


Copy = tuple[int, int, int, bytes]
"""The data after a write: version, version of the last stamp, version of the last change, block."""


@dataclass(slots=True)
class DataEvent:
    """A pending notification of a write.

    :param differs: whether the data changed.
    :param audience: the listeners at the time of the write.
    """

    copy: Copy
    differs: bool
    audience: DataAudience


class InterfaceCopy(BoardPort):
    """The copy of an interface's data, members and listeners.

    :param uplink: sends to the server.
    :param dispatcher: calls the listeners.
    """

    def __init__(
        self,
        board: BlackBoard,
        interface_class: type[Interface],
        interface_id: str,
        uplink: ZmqUplink,
        dispatcher: EventReceiver,
    ) -> None:
        super().__init__(board, interface_class, interface_id, 0)
        self.instances: list[Interface] = []
        """The instances of this client in the order of opening."""
        self.seq = 0
        """The sequence number of the copy in this session."""
        self.expected = 0
        """The last known sequence number of the server in the previous session."""
        self.written = False
        """Whether the copy was written by this client."""
        self._uplink: Final = uplink
        self._dispatcher: Final = dispatcher
        self._copy: Copy = (0, 0, 0, bytes(self.size))
        self._fetched = 0  # the newest version that was read
        self._view: Copy | None = None  # the data that read() returns to the listeners being notified
        self._tail: DataEvent | None = None  # the last pending event
        self._members: dict[UUID, Member] = {}

    def update(self, seq: int, block: bytes, stamped: bool, changed: bool) -> None:
        """Take over a write of another client.

        :raises ProtocolError: if the size of the block is wrong.
        """
        if len(block) != self.size:
            raise ProtocolError(f"a block of {self.uid} has not {len(block)} bytes")
        with self._lock:
            self.seq = seq
            self.written = False
            before = self._copy
            version = before[0] + 1
            copy = (version, version if stamped else before[1], version if changed else before[2], block)
            self._copy = copy
            audience = self.listeners.data_audience
            if audience is None:
                return
            tail = self._tail
            if tail is not None and self._dispatcher.full:
                tail.copy = copy
                tail.differs |= changed
                tail.audience = audience
                self._uplink.note_skipped()
                return
            event = self._tail = DataEvent(copy, changed, audience)
        self._dispatcher.put(self._notify_data, event)

    def _notify_data(self, event: DataEvent) -> None:
        with self._lock:
            if self._tail is event:
                self._tail = None
        self._view = event.copy
        try:
            self.listeners.notify_data(event.audience, event.differs)
        finally:
            self._view = None

    def change(self, kind: ChangeKind, serial: UUID, owner: str) -> None:
        """Add or remove a member and notify the listeners."""
        if kind in (ChangeKind.READER_ADDED, ChangeKind.WRITER_ADDED):
            if serial in self._members:
                return
            self._members = {**self._members, serial: Member(owner, kind is ChangeKind.WRITER_ADDED)}
        else:
            if serial not in self._members:
                return
            self._members = {key: member for key, member in self._members.items() if key != serial}
        event = _EVENTS[kind]
        self._dispatcher.put(self.listeners.notify_audience, self.listeners.audience(event), event, serial)

    def queue_message(self, writer: Interface, body: DeliverBody, block: bytes) -> tuple[ResultCode, int]:
        """Ask the listeners and queue a message for a writer; in the dispatcher's thread.

        :returns: the result and a detail for the server.
        """
        message_class = writer.MESSAGES.get(body.type)
        if message_class is None or len(block) != message_class.SCHEMA.datasize:
            return ResultCode.UNKNOWN_MESSAGE, 0
        message = receive_message(message_class, body, block, body.sender, self.mem_serial)
        if not self.listeners.accept(message):
            return ResultCode.DECLINED, 0
        try:
            writer.msgq_append(message)
        except QueueFullError as error:
            return ResultCode.QUEUE_FULL, error.limit
        except InvalidInstanceError:  # closed by a listener
            return ResultCode.NO_WRITER, 0
        return ResultCode.OK, 0

    def end_listening(self, instance: Interface) -> None:
        """Unregister the listeners of an instance after the pending notifications."""
        self._dispatcher.put(self._unregister, instance)

    def _unregister(self, instance: Interface) -> None:
        self.listeners.unregister(None, instance)

    def set_members(self, members: Iterable[Any], *, quietly: bool) -> None:
        """Replace the members.

        :param members: as in the protocol's Opened.
        :param quietly: do not notify the listeners.
        """
        new = {UUID(bytes=m.instance): Member(m.owner, m.writer) for m in members}
        old = self._members
        if quietly:
            self._members = new
            return
        for serial, member in old.items():
            if serial not in new:
                self.change(
                    ChangeKind.WRITER_REMOVED if member.writer else ChangeKind.READER_REMOVED, serial, ""
                )
        for serial, member in new.items():
            self.change(
                ChangeKind.WRITER_ADDED if member.writer else ChangeKind.READER_ADDED, serial, member.owner
            )
        self._members = new  # in the order of the server

    def forget_others(self) -> None:
        """Remove the instances of other clients, because the session is lost."""
        own = {instance.serial for instance in self.instances}
        for serial, member in self._members.items():
            if serial not in own:
                self.change(
                    ChangeKind.WRITER_REMOVED if member.writer else ChangeKind.READER_REMOVED, serial, ""
                )

    def snapshot(self) -> bytes:
        """Return the present block."""
        return self._copy[3]

    def _notified_copy(self) -> Copy | None:
        """Return the data of the notification in progress, unless newer data were read."""
        view = self._view
        if view is None or view[0] < self._fetched or threading.get_ident() != self._dispatcher.ident:
            return None
        return view

    @property
    def version(self) -> int:
        """How often the copy was replaced."""
        return ((None if self._view is None else self._notified_copy()) or self._copy)[0]

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        with self._lock:
            copy = (None if self._view is None else self._notified_copy()) or self._copy
            self._fetched = copy[0]
        version, stamped, changed, into[:] = copy
        return version, stamped, changed

    def publish(self, writer: OpenedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        data = bytes(block)
        with self._lock:
            _, old_stamped, old_changed, old = self._copy
            version = self._copy[0] + 1
            if stamped or (stamped is None and old[: STAMP.size] != data[: STAMP.size]):
                old_stamped = version
            self._copy = (version, old_stamped, version if changed else old_changed, data)
            self.written = True
            # listeners that register later read the data and are not notified
            audience = self.listeners.data_audience
        self._uplink.write(self, writer.serial, stamped, changed, data)
        if audience is not None:
            self.listeners.notify_data(audience, changed)
        return version

    def next_id(self, last: int) -> int:
        return self._unshown_id(last, self._copy[3])

    def transmit(self, sender: Interface, message: Message) -> None:
        self._uplink.send_message(sender, message)

    def has_writer(self) -> bool:
        return any(member.writer for member in self._members.values())

    def writer_owner(self) -> str:
        return next((member.owner for member in self._members.values() if member.writer), "")

    def reader_owners(self) -> tuple[str, ...]:
        return tuple(member.owner for member in self._members.values() if not member.writer)

    def reader_owner(self, serial: str) -> str:
        return next((member.owner for key, member in self._members.items() if str(key) == serial), "")
