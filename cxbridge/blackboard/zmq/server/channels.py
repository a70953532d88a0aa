"""A channel of the server: the updates of an interface for the clients that have the interface open."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol
from uuid import UUID

from cxbridge.blackboard.listeners import MEMBERSHIP_KINDS, EventKind, MembershipListener
from cxbridge.blackboard.local import InterfaceMemory
from cxbridge.blackboard.port import Snapshot
from cxbridge.blackboard.zmq.server.sessions import Membership, ZmqSession
from cxbridge.blackboard.zmq.wire.frames import Change, Update, encode
from cxbridge.interfaces.instance import Interface

# a local writer in a loop must not fill the memory while the server's thread is busy
MAX_QUEUED_UPDATES: Final = 256
"""The maximum number of updates of an interface that wait for the server's thread; more are conflated."""


class ServerLoop(Protocol):
    """The server's thread."""

    def is_current_thread(self) -> bool:
        """Return whether the caller runs in the server's thread."""

    def post(self, function: Callable[..., None], *args: Any) -> None:
        """Queue a call for the server's thread; calls stay in order."""

    def run_posted_calls(self) -> None:
        """Make the posted calls now; for the server's thread only."""


class RemoteWriter(NamedTuple):
    """A writer in a client.

    :param session: the session of the client.
    :param instance: the server's instance for the writer.
    """

    session: ZmqSession
    instance: Interface


class Channel(MembershipListener):
    """An interface of the local blackboard that clients have open.

    A listener needs an instance, but the channel must not count as a reader. So the channel registers its
    listener for an instance that is not attached to the memory.

    :param loop: the server's thread.
    """

    def __init__(self, loop: ServerLoop, memory: InterfaceMemory) -> None:
        self.memory: Final = memory
        self.writer: RemoteWriter | None = None
        """The writer if it belongs to a client; None for a local writer or without writer."""
        self.memberships: Final[dict[ZmqSession, Membership]] = {}
        self._loop = loop
        self._queued_count = 0
        self._watcher = memory.interface_class(
            memory, id=memory.id, owner="", serial=UUID(int=0), writer=False
        )
        memory.listeners.register(self, self._watcher, (EventKind.DATA_REFRESHED, *MEMBERSHIP_KINDS))

    def join(self, session: ZmqSession, instance: Interface) -> Snapshot | None:
        """Add an instance of a session.

        :returns: the present data; None if the session has the present data already.
        """
        membership = self.memberships.get(session)
        snapshot = None
        if membership is None or self in session.waiting_channels:
            session.waiting_channels.pop(self, None)  # the reply has the data of the waiting update
            snapshot = self.memory.snapshot
            membership = self.memberships.setdefault(session, Membership(snapshot.version))
            membership.sent_seq = snapshot.version
            session.memberships[self] = membership
        membership.instance_serials.add(instance.serial.bytes)
        if instance.is_writer:
            self.writer = RemoteWriter(session, instance)
        return snapshot

    def leave(self, session: ZmqSession, instance: Interface) -> int:
        """Remove a closed instance; return the sequence number of the client's copy."""
        membership = self.memberships[session]
        membership.instance_serials.discard(instance.serial.bytes)
        if self.writer is not None and self.writer.instance is instance:
            self.writer = None
        if not membership.instance_serials:
            del self.memberships[session], session.memberships[self]
            session.waiting_channels.pop(self, None)
        return membership.sent_seq

    def end(self) -> None:
        """End listening, after the last client has closed its instances."""
        self.memory.listeners.unregister(self, self._watcher)

    def data_refreshed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's signature
        if self._loop.is_current_thread():
            self._send_update(self.memory.snapshot)
        elif self._queued_count < MAX_QUEUED_UPDATES:
            self._queued_count += 1
            # the call at the limit sends the newest data, which include all further updates
            self._loop.post(
                self._send_queued_update,
                None if self._queued_count == MAX_QUEUED_UPDATES else self.memory.snapshot,
            )

    def _send_queued_update(self, snapshot: Snapshot | None) -> None:
        self._queued_count -= 1
        if self.memberships:
            self._send_update(snapshot or self.memory.snapshot)

    def _send_update(self, snapshot: Snapshot) -> None:
        """Send an update to all sessions except the writer's."""
        writer_session = None if self.writer is None else self.writer.session
        version = snapshot.version
        shared_frame: bytes | None = None  # the frame for all sessions that have every earlier write
        for session, membership in self.memberships.items():
            if membership.sent_seq >= version:
                continue
            if session is writer_session:
                membership.sent_seq = version  # the client has the data that it wrote
            elif session.credit <= 0:
                session.waiting_channels[self] = None
            elif membership.sent_seq == version - 1:
                if shared_frame is None:
                    shared_frame = self._encode_update(snapshot, membership.sent_seq)
                membership.sent_seq = version
                session.credit -= 1
                session.send_bytes(shared_frame)
            else:
                self._send_update_to(session, membership, snapshot)

    def send_latest(self, session: ZmqSession) -> None:
        """Send the present data to one session."""
        membership = self.memberships.get(session)
        snapshot = self.memory.snapshot
        if membership is not None and snapshot.version > membership.sent_seq:
            self._send_update_to(session, membership, snapshot)

    def _send_update_to(self, session: ZmqSession, membership: Membership, snapshot: Snapshot) -> None:
        session.credit -= 1
        frame = self._encode_update(snapshot, membership.sent_seq)
        membership.sent_seq = snapshot.version
        session.send_bytes(frame)

    def _encode_update(self, snapshot: Snapshot, sent_seq: int) -> bytes:
        """Return the Update for a client that has the data of write number ``sent_seq``."""
        seq = snapshot.version
        stamped, changed = snapshot.last_stamped > sent_seq, snapshot.last_changed > sent_seq
        return encode(
            Update(self.memory.mem_serial, seq, stamped, changed, seq - sent_seq - 1, snapshot.block)
        )

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:  # noqa: ARG002 - as above
        if self._loop.is_current_thread():
            self._send_change(kind, serial)
        else:
            self._loop.post(self._send_change, kind, serial)

    def _send_change(self, kind: EventKind, serial: UUID) -> None:
        owner = next((member.owner for member in self.memory.instances() if member.serial == serial), "")
        for session in tuple(self.memberships):
            session.send(Change(self.memory.mem_serial, kind, serial.bytes, owner))
