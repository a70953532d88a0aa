"""A channel of the server: updates and changes of an interface for the clients that have it open."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.listeners import MEMBERSHIP_KINDS, EventKind, MembershipListener
from cxbridge.blackboard.local import InterfaceMemory
from cxbridge.blackboard.port import Snapshot
from cxbridge.blackboard.zmq.server.sessions import Membership, ZmqSession
from cxbridge.blackboard.zmq.wire.frames import Change, Update, encode
from cxbridge.interfaces.instance import Interface

# a local writer in a loop must not fill the memory while the server's thread is busy
MAX_QUEUED: Final = 256
"""The number of updates of an interface waiting for the server's thread; above it they are conflated."""


class ServerLoop(Protocol):
    """The server's thread."""

    def is_current_thread(self) -> bool:
        """Return whether the caller runs in the server's thread."""

    def post(self, work: Callable[..., None], *args: Any) -> None:
        """Call a function in the server's thread; calls stay in order."""

    def drain(self) -> None:
        """Carry out the posted calls; to be called in the server's thread."""


class RemoteWriter(NamedTuple):
    """A writer in a client.

    :param session: the session of the client.
    :param instance: the server's instance for the writer.
    """

    session: ZmqSession
    instance: Interface


class Channel(MembershipListener):
    """An interface of the local blackboard that clients have open.

    The channel must not count as a reader, so it registers its listener for an instance of a client, the
    *carrier*.

    :param loop: the server's thread.
    """

    def __init__(self, board: BlackBoard, loop: ServerLoop, memory: InterfaceMemory) -> None:
        self.memory: Final = memory
        self.writer: RemoteWriter | None = None
        """The writer, if it is a client."""
        self.members: Final[dict[ZmqSession, Membership]] = {}
        self._board = board
        self._loop = loop
        self._carrier: Interface | None = None
        self._queued = 0
        self._last_change: tuple[EventKind, UUID] | None = None

    def join(self, session: ZmqSession, instance: Interface) -> Snapshot | None:
        """Add an instance of a session.

        :returns: the present data, None if the session has them.
        """
        if self._carrier is None:
            self._set_carrier(instance)
        membership = self.members.get(session)
        snapshot = None
        if membership is None or self in session.dirty:
            session.dirty.pop(self, None)  # the reply has the data that the update would have
            snapshot = self.memory.snapshot
            membership = self.members.setdefault(session, Membership(snapshot.version))
            session.skipped += max(0, snapshot.version - membership.sent - 1)
            membership.sent = snapshot.version
            session.memberships[self] = membership
        membership.instances.add(instance.serial.bytes)
        if instance.is_writer:
            self.writer = RemoteWriter(session, instance)
        return snapshot

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
        if self.writer is not None and self.writer.instance is instance:
            self.writer = None
        if self._carrier is instance:
            self._carrier = None
        if not membership.instances:
            del self.members[session], session.memberships[self]
            session.dirty.pop(self, None)
        return membership.sent

    def _set_carrier(self, instance: Interface) -> None:
        self._carrier = instance
        self._board.register_listener(self, instance, EventKind.DATA_REFRESHED, *MEMBERSHIP_KINDS)

    def data_refreshed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's signature
        if self._loop.is_current_thread():
            self._push(self.memory.snapshot)
        elif self._queued < MAX_QUEUED:  # above the limit, the last queued update sends the newest data
            self._queued += 1
            self._loop.post(self._push_queued, None if self._queued == MAX_QUEUED else self.memory.snapshot)

    def _push_queued(self, snapshot: Snapshot | None) -> None:
        self._queued -= 1
        if self.members:
            self._push(snapshot or self.memory.snapshot)

    def _push(self, snapshot: Snapshot) -> None:
        """Send an update to all sessions except the writer's."""
        writer = None if self.writer is None else self.writer.session
        version = snapshot.version
        common: bytes | None = None  # the frame of all sessions that have got every earlier write
        for session, membership in self.members.items():
            if membership.sent >= version:
                continue
            if session is writer:
                membership.sent = version  # the client has the data of its own write
            elif session.credit <= 0:
                session.dirty[self] = None
            elif membership.sent == version - 1:
                if common is None:
                    common = self._encode(snapshot, membership.sent)
                membership.sent = version
                session.credit -= 1
                session.send_bytes(common)
            else:
                self._push_to(session, membership, snapshot)

    def push_latest(self, session: ZmqSession) -> None:
        """Send the present data to one session."""
        membership = self.members.get(session)
        snapshot = self.memory.snapshot
        if membership is not None and snapshot.version > membership.sent:
            self._push_to(session, membership, snapshot)

    def _push_to(self, session: ZmqSession, membership: Membership, snapshot: Snapshot) -> None:
        session.skipped += snapshot.version - membership.sent - 1
        session.credit -= 1
        data = self._encode(snapshot, membership.sent)
        membership.sent = snapshot.version
        session.send_bytes(data)

    def _encode(self, snapshot: Snapshot, sent: int) -> bytes:
        """Return the Update for a client that has the data of write number ``sent``."""
        seq = snapshot.version
        stamped, changed = snapshot.last_stamped > sent, snapshot.last_changed > sent
        return encode(Update(self.memory.mem_serial, seq, stamped, changed, seq - sent - 1, snapshot.block))

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:  # noqa: ARG002
        if self._loop.is_current_thread():
            self._send_change(kind, serial)
        else:
            self._loop.post(self._send_change, kind, serial)

    def _send_change(self, kind: EventKind, serial: UUID) -> None:
        if self._last_change == (kind, serial):  # reported twice when the carrier changed, see hand_over
            return
        self._last_change = (kind, serial)
        owner = next((member.owner for member in self.memory.instances() if member.serial == serial), "")
        for session in tuple(self.members):
            session.send(Change(self.memory.mem_serial, kind, serial.bytes, owner))
