"""A channel of the server: updates and changes of an interface for the clients that have it open."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.listeners import EventKind, Listener
from cxbridge.blackboard.local import InterfaceMemory
from cxbridge.blackboard.zmq.server.sessions import Membership, ZmqSession
from cxbridge.blackboard.zmq.wire.codec import ChangeKind
from cxbridge.blackboard.zmq.wire.dataframes import pack_update
from cxbridge.interfaces.instance import Interface

MAX_QUEUED: Final = 256
"""The number of updates of an interface waiting for the server's thread; above it they are conflated."""

_KINDS: Final = (
    EventKind.DATA_REFRESHED,
    EventKind.READER_ADDED,
    EventKind.READER_REMOVED,
    EventKind.WRITER_ADDED,
    EventKind.WRITER_REMOVED,
)


class ServerLoop(Protocol):
    """The server's thread."""

    def inside(self) -> bool: ...

    def post(self, work: Callable[..., None], *args: Any) -> None:
        """Call a function in the server's thread; calls stay in order."""

    def drain(self) -> None:
        """Make the posted calls; in the server's thread."""


class InterfaceValue(NamedTuple):
    """The data of an interface at some time.

    :param seq: the number of the last write.
    :param stamped: the number of the last write with a new time stamp.
    :param changed: the number of the last write with changed data.
    """

    seq: int
    stamped: int
    changed: int
    block: bytes


class Channel(Listener):
    """An interface of the local blackboard that clients have open.

    The channel must not count as a reader, so it registers its listener for an instance of a client, the
    *carrier*.

    :param loop: the server's thread.
    """

    def __init__(self, board: BlackBoard, loop: ServerLoop, memory: InterfaceMemory) -> None:
        self.memory: Final = memory
        self.writer: tuple[ZmqSession, Interface] | None = None
        """The session with the writer and the server's instance for it."""
        self.members: Final[dict[ZmqSession, Membership]] = {}
        self._board = board
        self._loop = loop
        self._carrier: Interface | None = None
        self._written: bytes | None = None  # the block being published
        self._queued = 0
        self._last: tuple[ChangeKind, UUID] | None = None

    def join(self, session: ZmqSession, instance: Interface) -> InterfaceValue | None:
        """Add an instance of a session.

        :returns: the initial data, None if the session has them.
        """
        if self._carrier is None:
            self._set_carrier(instance)
        membership = self.members.get(session)
        value = None
        if membership is None or self in session.dirty:
            session.dirty.pop(self, None)
            value = self.value()
            membership = self.members.setdefault(session, Membership(value.seq))
            session.skipped += max(0, value.seq - membership.sent - 1)
            membership.sent = value.seq
            session.memberships[self] = membership
        membership.instances.add(instance.serial.bytes)
        if instance.is_writer:
            self.writer = (session, instance)
        return value

    def hand_over(self, leaving: Interface) -> None:
        """Move the listener to another instance before the carrier is closed."""
        if self._carrier is leaving:
            for session, membership in self.members.items():
                for serial in membership.instances:
                    if serial != leaving.serial.bytes:
                        self._set_carrier(session.instances[serial])
                        return

    def leave(self, session: ZmqSession, instance: Interface) -> int:
        """Remove a closed instance; return the client's sequence number."""
        membership = self.members[session]
        membership.instances.discard(instance.serial.bytes)
        if self.writer is not None and self.writer[1] is instance:
            self.writer = None
        if self._carrier is instance:
            self._carrier = None
        if not membership.instances:
            del self.members[session], session.memberships[self]
            session.dirty.pop(self, None)
        return membership.sent

    def _set_carrier(self, instance: Interface) -> None:
        self._carrier = instance
        self._board.register_listener(self, instance, *_KINDS)

    def write(self, instance: Interface, block: bytes, stamped: bool | None, changed: bool) -> None:
        """Publish the write of a client; in the server's thread."""
        self._written = block
        try:
            instance.publish_block(block, stamped, changed)
        finally:
            self._written = None

    def value(self) -> InterfaceValue:
        """Return the present data."""
        if self._written is not None:  # saves a copy
            return InterfaceValue(*self.memory.versions(), self._written)
        block = bytearray(self.memory_size)
        version, stamped, changed = self.memory.fetch(block)
        return InterfaceValue(version, stamped, changed, bytes(block))

    @property
    def memory_size(self) -> int:
        """The size of the block in bytes."""
        assert self._carrier is not None
        return int(self._carrier.SCHEMA.datasize)

    def data_refreshed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's method
        if self._loop.inside():
            self._push(self.value())
        elif self._queued < MAX_QUEUED:  # above the limit, the last queued update sends the newest value
            self._queued += 1
            self._loop.post(self._push_queued, None if self._queued == MAX_QUEUED else self.value())

    def _push_queued(self, value: InterfaceValue | None) -> None:
        self._queued -= 1
        if self.members:
            self._push(self.value() if value is None else value)

    def _push(self, value: InterfaceValue) -> None:
        """Send an update to all sessions except the writer's."""
        writer = None if self.writer is None else self.writer[0]
        common: bytes | None = None
        for session, membership in self.members.items():
            if membership.sent >= value.seq:
                continue
            if session is writer:
                membership.sent = value.seq
            elif session.credit <= 0:
                session.dirty[self] = None
            elif membership.sent == value.seq - 1:
                if common is None:
                    common = self._encode(value, membership.sent)
                membership.sent = value.seq
                session.credit -= 1
                session.send_frame(common)
            else:
                self._push_to(session, membership, value)

    def push_latest(self, session: ZmqSession) -> None:
        """Send the present data to one session."""
        membership = self.members.get(session)
        if membership is not None:
            value = self.value()
            if value.seq > membership.sent:
                self._push_to(session, membership, value)

    def _push_to(self, session: ZmqSession, membership: Membership, value: InterfaceValue) -> None:
        session.skipped += value.seq - membership.sent - 1
        session.credit -= 1
        frame = self._encode(value, membership.sent)
        membership.sent = value.seq
        session.send_frame(frame)

    def _encode(self, value: InterfaceValue, sent: int) -> bytes:
        seq, stamped, changed, block = value
        return pack_update(self.memory.mem_serial, seq, stamped > sent, changed > sent, seq - sent - 1, block)

    def reader_added(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._notify(ChangeKind.READER_ADDED, serial)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._notify(ChangeKind.READER_REMOVED, serial)

    def writer_added(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._notify(ChangeKind.WRITER_ADDED, serial)

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._notify(ChangeKind.WRITER_REMOVED, serial)

    def _notify(self, kind: ChangeKind, serial: UUID) -> None:
        if self._loop.inside():
            self._send_change(kind, serial)
        else:
            self._loop.post(self._send_change, kind, serial)

    def _send_change(self, kind: ChangeKind, serial: UUID) -> None:
        if self._last == (kind, serial):  # reported twice when the carrier changed, see hand_over
            return
        self._last = (kind, serial)
        owner = next((member.owner for member in self.memory.instances() if member.serial == serial), "")
        body = {
            "channel": self.memory.mem_serial,
            "kind": int(kind),
            "instance": serial.bytes,
            "owner": owner,
        }
        for session in tuple(self.members):
            session.send("change", body)
