"""The copy of an interface at a client; the port of the client's instances.

The receiving thread updates the copy, the threads of the instances read and write it, and the dispatcher's
thread notifies the listeners. The lock guards the copy.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Final, Protocol
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import InvalidInstanceError, QueueFullError, UnknownMessageTypeError
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import DataAudience, EventKind, membership_kind
from cxbridge.blackboard.port import BoardPort, Snapshot, make_received_message
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.wire.frames import Deliver, Member, ResultCode
from cxbridge.errors import InterfaceError
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.message import InstanceIdentity


class ZmqUplink(Protocol):
    """Sends the writes and messages of a copy to the server."""

    def write(
        self, copy: InterfaceCopy, serial: UUID, stamped: bool | None, changed: bool, block: bytes
    ) -> None:
        """Send a write, or keep the block for later."""

    def send_message(self, sender: Interface, message: Message) -> None:
        """Send a message and wait for its outcome."""

    def count_skipped(self) -> None:
        """Count a conflated update."""


@dataclass(slots=True)
class WriteNotification:
    """A pending notification of a write.

    :param changed: whether values changed.
    :param audience: the listeners at the time of the write.
    """

    snapshot: Snapshot
    changed: bool
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
        """The sequence number of the copy in this session: the number of the last write that it contains."""
        self.expected_seq = 0
        """The sequence number of the copy at the end of the previous session."""
        self.has_own_data = False
        """Whether the data are from a write of this client."""
        self._uplink: Final = uplink
        self._dispatcher: Final = dispatcher
        self._fetched_version = 0  # the newest version that an instance has read
        self._notified_snapshot: Snapshot | None = None  # the data that listeners read during a notification
        # the last pending event, which a further update may replace
        self._last_notification: WriteNotification | None = None
        self._members: dict[UUID, Member] = {}  # the open instances of all clients

    def update(self, seq: int, block: bytes, stamped: bool, changed: bool) -> None:
        """Store data that the server has sent, and queue the notification of the listeners.

        :raises ProtocolError: if the size of the block is wrong.
        """
        if len(block) != self.size:
            raise ProtocolError(f"a block of {self.uid} cannot have {len(block)} bytes")
        with self._lock:
            self.seq = seq
            self.has_own_data = False
            snapshot = self._replace_snapshot(block, stamped, changed)
            audience = self.listeners.data_audience
            if audience is None:
                return
            notification = self._last_notification
            if notification is not None and self._dispatcher.is_full:
                notification.snapshot = snapshot
                notification.changed |= changed
                notification.audience = audience
                self._uplink.count_skipped()
                return
            notification = self._last_notification = WriteNotification(snapshot, changed, audience)
        self._dispatcher.put(self._notify_data, notification)

    def _notify_data(self, notification: WriteNotification) -> None:
        with self._lock:
            if self._last_notification is notification:
                self._last_notification = None
        self._notified_snapshot = notification.snapshot
        try:
            self.listeners.notify_data(notification.audience, notification.changed)
        finally:
            self._notified_snapshot = None

    def change_member(self, kind: EventKind, serial: UUID, owner: str) -> None:
        """Add or remove a member and notify the listeners."""
        is_added = kind in (EventKind.READER_ADDED, EventKind.WRITER_ADDED)
        # other threads iterate over the members without a lock, so the dictionary is replaced
        members = dict(self._members)
        member = members.pop(serial, None)
        if is_added is (member is not None):
            return  # the members in a reply to Open contain the change already
        if is_added:
            members[serial] = Member(serial.bytes, owner, kind is EventKind.WRITER_ADDED)
        self._members = members
        self._dispatcher.put(self.listeners.notify_audience, self.listeners.find_audience(kind), kind, serial)

    def queue_message(self, writer: Interface, frame: Deliver) -> tuple[ResultCode, int]:
        """Queue a message for a writer unless a listener handles it; called in the dispatcher's thread.

        :returns: the outcome, and the limit of the queue for ``QUEUE_FULL``, else 0.
        """
        try:
            message = make_received_message(
                writer,
                frame.type,
                frame.block,
                message_id=frame.id,
                sender=UUID(bytes=frame.sender),
                source=UUID(bytes=frame.source),
                hops=frame.hops + 1,
                thread=frame.thread,
            )
            return ResultCode.OK if self.deliver(writer, message) else ResultCode.DECLINED, 0
        except QueueFullError as error:
            return ResultCode.QUEUE_FULL, error.limit
        except InvalidInstanceError:  # a listener has closed the writer
            return ResultCode.NO_WRITER, 0
        except (UnknownMessageTypeError, InterfaceError):
            return ResultCode.UNKNOWN_MESSAGE, 0

    def end_listening(self, instance: Interface) -> None:
        """Unregister the listeners of an instance after the pending notifications."""
        self._dispatcher.put(self.listeners.unregister, None, instance)

    def set_members(self, members: Iterable[Member], *, quietly: bool) -> None:
        """Replace the members.

        :param quietly: whether to omit the notification of the listeners.
        """
        members_by_serial = {UUID(bytes=member.serial): member for member in members}
        if not quietly:
            self._remove_members(self._members.keys() - members_by_serial.keys())
            for serial, member in members_by_serial.items():
                self.change_member(membership_kind(writer=member.writer, added=True), serial, member.owner)
        self._members = members_by_serial  # even after these changes, for the server's order of the members

    def _remove_members(self, serials: AbstractSet[UUID]) -> None:
        for serial, member in self._members.items():
            if serial in serials:
                self.change_member(membership_kind(writer=member.writer, added=False), serial, "")

    def remove_remote_members(self) -> None:
        """Remove the instances of other clients, because the session is lost."""
        self._remove_members(self._members.keys() - {instance.serial for instance in self.instances})

    @property
    def _readable_snapshot(self) -> Snapshot:
        """The data that the calling thread reads.

        A listener reads the data of the write in its notification, even if newer data have arrived, unless
        an instance has read newer data before.
        """
        notified_snapshot = self._notified_snapshot
        if (
            notified_snapshot is None
            or notified_snapshot.version < self._fetched_version
            or not self._dispatcher.is_current_thread()
        ):
            return self.snapshot
        return notified_snapshot

    @property
    def version(self) -> int:
        """The number of the write that :meth:`fetch` would return."""
        return self._readable_snapshot.version

    def fetch(self, target: bytearray) -> tuple[int, int, int]:
        with self._lock:
            snapshot = self._readable_snapshot
            self._fetched_version = snapshot.version
        target[:] = snapshot.block
        return snapshot.version, snapshot.last_stamped, snapshot.last_changed

    def publish(
        self, writer: InstanceIdentity, block: bytes | bytearray, stamped: bool | None, changed: bool
    ) -> int:
        block_copy = bytes(block)
        with self._lock:
            version = self._replace_snapshot(block_copy, stamped, changed).version
            self.has_own_data = True
            # listeners that register later read the data and are not notified
            audience = self.listeners.data_audience
        self._uplink.write(self, writer.serial, stamped, changed, block_copy)
        if audience is not None:
            self.listeners.notify_data(audience, changed)
        return version

    def transmit(self, sender: Interface, message: Message) -> None:
        self._uplink.send_message(sender, message)

    def has_writer(self) -> bool:
        return any(member.writer for member in self._members.values())

    def writer_owner(self) -> str:
        return next((member.owner for member in self._members.values() if member.writer), "")

    def reader_owners(self) -> tuple[str, ...]:
        return tuple(member.owner for member in self._members.values() if not member.writer)

    def reader_owner(self, serial: str) -> str:
        return next((member.owner for uuid, member in self._members.items() if str(uuid) == serial), "")
