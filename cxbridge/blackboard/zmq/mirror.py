"""A client's copy of an interface: the port of the instances that the client has of it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol
from uuid import UUID

from cxbridge.blackboard.listeners import Audience, EventKind, ListenerTable, Report
from cxbridge.blackboard.zmq.codec import Kind
from cxbridge.blackboard.zmq.dispatcher import Dispatcher
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.shared import SharedBlock

if TYPE_CHECKING:
    from cxbridge.clock import Clock

_EVENTS: Final = {
    Kind.READER_ADDED: EventKind.READER_ADDED,
    Kind.READER_REMOVED: EventKind.READER_REMOVED,
    Kind.WRITER_ADDED: EventKind.WRITER_ADDED,
    Kind.WRITER_REMOVED: EventKind.WRITER_REMOVED,
}


class Wire(Protocol):
    """What a mirror asks of the blackboard it belongs to."""

    @property
    def clock(self) -> Clock:
        """Gives time stamps."""

    def close(self, instance: Interface) -> None:
        """Take an instance off the blackboard."""

    def send_write(
        self, mirror: Mirror, serial: UUID, block: bytes, stamped: bool | None, changed: bool
    ) -> None:
        """Send a block to the server."""

    def send_message(self, sender: Interface, message: Message) -> None:
        """Send a message and wait for what became of it."""

    def note_skipped(self) -> None:
        """Count an update that listeners do not hear of."""


@dataclass(slots=True)
class Member:
    """Somebody who has the interface open, here or elsewhere."""

    owner: str
    writer: bool


@dataclass(slots=True)
class DataEvent:
    """A write that listeners are still to hear of, and the data as it left them.

    :param version: of the copy here; ``stamped`` and ``changed`` as in a port.
    :param differs: whether to tell of changed data.
    :param refreshed: who listened for refreshed data when it came.
    :param altered: who listened for changed data.
    """

    version: int
    stamped: int
    changed: int
    block: bytes
    differs: bool
    refreshed: Audience
    altered: Audience


class Mirror:
    """The copy, who has the interface open, who listens.

    :param instance_class: of the first instance.
    :param interface_id: the interface's id.
    :param wire: the blackboard.
    :param dispatcher: calls the listeners.
    :param report: told of listeners that fail.
    """

    def __init__(
        self,
        instance_class: type[Interface],
        interface_id: str,
        wire: Wire,
        dispatcher: Dispatcher,
        report: Report,
    ) -> None:
        schema = instance_class.SCHEMA
        self.key: Final = (schema.name, interface_id)
        self.uid: Final = f"{schema.name}::{interface_id}"
        self.size: Final = schema.datasize
        self.mem_serial = 0
        self.listeners: Final = ListenerTable(report)
        self.close: Final[Callable[[Interface], None]] = wire.close
        self.now_us: Final[Callable[[], int]] = wire.clock.now_us
        self.instances: list[Interface] = []
        """Those of this client, in the order of opening."""
        self.seq = 0
        """Sequence number of the copy in this session."""
        self.expected = 0
        """Sequence number that the server had in the session before, as far as is known."""
        self.written = False
        """Whether the copy comes from this client's writer."""
        self._wire = wire
        self._dispatcher = dispatcher
        self._lock = threading.Lock()
        self._data = bytearray(schema.datasize)
        self._version = self._stamped = self._changed = 0
        self._fetched = 0  # the newest version that anybody has read
        self._view: DataEvent | None = None  # what read() gives to the listeners that are being told
        self._tail: DataEvent | None = None  # the event that waits last
        self._members: dict[UUID, Member] = {}

    # -- from the server, in the thread of the link

    def update(self, seq: int, block: bytes, *, stamped: bool, changed: bool) -> None:
        """Take over what somebody wrote."""
        with self._lock:
            self.seq = seq
            self.written = False
            self._version = version = self._version + 1
            if stamped:
                self._stamped = version
            if changed:
                self._changed = version
            self._data[:] = block
            if not self.listeners.has_data:
                return
            refreshed = self.listeners.audience(EventKind.DATA_REFRESHED)
            altered = self.listeners.audience(EventKind.DATA_CHANGED)
            tail = self._tail
            if tail is not None and self._dispatcher.full:
                tail.version, tail.stamped, tail.changed, tail.block = (
                    version,
                    self._stamped,
                    self._changed,
                    block,
                )
                tail.differs |= changed
                tail.refreshed, tail.altered = refreshed, altered
                self._wire.note_skipped()
                return
            event = self._tail = DataEvent(
                version, self._stamped, self._changed, block, changed, refreshed, altered
            )
        self._dispatcher.put(self._tell_data, event)

    def _tell_data(self, event: DataEvent) -> None:
        with self._lock:
            if self._tail is event:
                self._tail = None
        self._view = event
        try:
            self.listeners.tell(event.refreshed, EventKind.DATA_REFRESHED)
            if event.differs:
                self.listeners.tell(event.altered, EventKind.DATA_CHANGED)
        finally:
            self._view = None

    def change(self, kind: Kind, serial: UUID, owner: str) -> None:
        """Note who came or went, and tell the listeners."""
        if kind in (Kind.READER_ADDED, Kind.WRITER_ADDED):
            if serial in self._members:
                return
            self._members = {**self._members, serial: Member(owner, kind is Kind.WRITER_ADDED)}
        else:
            if serial not in self._members:
                return
            self._members = {key: member for key, member in self._members.items() if key != serial}
        event = _EVENTS[kind]
        self._dispatcher.put(self.listeners.tell, self.listeners.audience(event), event, serial)

    def end_listening(self, instance: Interface) -> None:
        """Tell nobody more on behalf of an instance; after what is on its way."""
        self._dispatcher.put(self._unregister, instance)

    def _unregister(self, instance: Interface) -> None:
        self.listeners.unregister(None, instance)

    def set_members(self, members: Iterable[Any], *, quietly: bool) -> None:
        """Replace who has it open: members as the protocol's Opened has them.

        :param quietly: do not tell the listeners.
        """
        new = {UUID(bytes=m.instance): Member(m.owner, m.writer) for m in members}
        old = self._members
        if quietly:
            self._members = new
            return
        for serial, member in old.items():
            if serial not in new:
                self.change(Kind.WRITER_REMOVED if member.writer else Kind.READER_REMOVED, serial, "")
        for serial, member in new.items():
            self.change(Kind.WRITER_ADDED if member.writer else Kind.READER_ADDED, serial, member.owner)
        self._members = new  # in the server's order

    def forget_others(self) -> None:
        """Note that nobody else is there as far as one can see: the session is lost."""
        own = {instance.serial for instance in self.instances}
        for serial, member in self._members.items():
            if serial not in own:
                self.change(Kind.WRITER_REMOVED if member.writer else Kind.READER_REMOVED, serial, "")

    def snapshot(self) -> bytes:
        """Return the copy as it is now."""
        with self._lock:
            return bytes(self._data)

    # -- the port of the instances

    def _event(self) -> DataEvent | None:
        """Return the event that the caller is just being told of, unless somebody read newer data."""
        view = self._view
        if view is None or view.version < self._fetched or threading.get_ident() != self._dispatcher.ident:
            return None
        return view

    @property
    def version(self) -> int:
        """How often the copy was replaced."""
        if self._view is not None:
            view = self._event()
            if view is not None:
                return view.version
        return self._version

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        """Give the copy; see :class:`~cxbridge.interfaces.port.Port`."""
        with self._lock:
            view = None if self._view is None else self._event()
            if view is not None:
                into[:] = view.block
                self._fetched = view.version
                return view.version, view.stamped, view.changed
            into[:] = self._data
            self._fetched = self._version
            return self._version, self._stamped, self._changed

    def publish(self, writer: SharedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        """Take over the writer's block, send it, tell the listeners; see the port."""
        data = bytes(block)
        with self._lock:
            self._version = version = self._version + 1
            if stamped or (stamped is None and self._data[: STAMP.size] != data[: STAMP.size]):
                self._stamped = version
            if changed:
                self._changed = version
            self._data[:] = data
            self.written = True
            listened = self.listeners.has_data
            if listened:  # who comes a moment later can read the data, and is not told of them
                refreshed = self.listeners.audience(EventKind.DATA_REFRESHED)
                altered = self.listeners.audience(EventKind.DATA_CHANGED)
        self._wire.send_write(self, writer.serial, data, stamped, changed)
        if listened:
            self.listeners.tell(refreshed, EventKind.DATA_REFRESHED)
            if changed:
                self.listeners.tell(altered, EventKind.DATA_CHANGED)
        return version

    def transmit(self, sender: Interface, message: Message) -> None:
        """Send a message; see :class:`~cxbridge.interfaces.port.Port`."""
        self._wire.send_message(sender, message)

    def has_writer(self) -> bool:
        """Return whether somebody has the interface open for writing."""
        return any(member.writer for member in self._members.values())

    def writer_owner(self) -> str:
        """Return the writer's owner; empty when there is no writer."""
        return next((member.owner for member in self._members.values() if member.writer), "")

    def reader_owners(self) -> tuple[str, ...]:
        """Return the readers' owners, in the order of opening."""
        return tuple(member.owner for member in self._members.values() if not member.writer)
