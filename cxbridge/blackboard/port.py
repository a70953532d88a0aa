"""The base class of ports, which connect the instances of one interface to their blackboard.

A port has the data, the message ids and the listeners of the interface. Each transport has a subclass of
:class:`BoardPort`, and makes received messages by :func:`make_received_message`.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final
from uuid import UUID

from msgspec import Struct

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.listeners import ListenerTable
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.message import UNKNOWN_THREAD
from cxbridge.interfaces.message_ids import id_offset, next_id, read_id


class Snapshot(Struct, frozen=True, gc=False):
    """The data of an interface after a write.

    Each write makes a snapshot, which the garbage collector need not track (``gc=False``), because numbers
    and bytes cannot refer to a snapshot.

    :param version: the number of the write, from 1; 0 before the first write.
    :param last_stamped: the number of the last write with a new time stamp.
    :param last_changed: the number of the last write with changed values.
    """

    version: int
    last_stamped: int
    last_changed: int
    block: bytes


class BoardPort:
    """An interface on a blackboard; the transport's subclass carries out writes and sends messages.

    A write replaces the whole snapshot, so a reader in another thread needs no lock to get all parts of the
    same write. The lock orders the writes.

    :param interface_class: the class of the first instance.
    :param mem_serial: the number of the interface on the blackboard.
    """

    def __init__(
        self, board: BlackBoard, interface_class: type[Interface], interface_id: str, mem_serial: int
    ) -> None:
        schema = interface_class.SCHEMA
        self._board: Final = board
        self.interface_class: Final = interface_class
        self.type: Final = schema.name
        self.id: Final = interface_id
        self.key: Final = (schema.name, interface_id)
        self.uid: Final = f"{schema.name}::{interface_id}"
        self.hash: Final = schema.hash
        self.size: Final = schema.datasize
        self.mem_serial = mem_serial
        self.listeners: Final = ListenerTable(board.report_fault)
        self.close: Final[Callable[[Interface], None]] = board.close
        self.now_us: Final[Callable[[], int]] = board.clock.now_us
        self._lock: Final = threading.Lock()
        self._id_offset: Final = id_offset(schema)
        self.snapshot = Snapshot(0, 0, 0, bytes(self.size))
        """The present data."""

    @property
    def version(self) -> int:
        """The number of writes."""
        return self.snapshot.version

    def fetch(self, target: bytearray) -> tuple[int, int, int]:
        """Copy the block, see :class:`~cxbridge.interfaces.message.Port`."""
        snapshot = self.snapshot  # read once, because another thread may replace the snapshot
        target[:] = snapshot.block
        return snapshot.version, snapshot.last_stamped, snapshot.last_changed

    def _replace_snapshot(self, block: bytes, stamped: bool | None, changed: bool) -> Snapshot:
        """Replace the data by the data of a write; the caller holds the lock.

        :param stamped: whether the time stamp is new; None to compare the time stamps of the blocks.
        """
        previous = self.snapshot
        version = previous.version + 1
        if stamped is None:
            stamped = block[: STAMP.size] != previous.block[: STAMP.size]
        last_stamped = version if stamped else previous.last_stamped
        last_changed = version if changed else previous.last_changed
        self.snapshot = Snapshot(version, last_stamped, last_changed, block)
        return self.snapshot

    def deliver(self, writer: Interface, message: Message) -> bool:
        """Append a message to the writer's queue unless a listener handles it; return whether it is queued.

        :raises BlackBoardError: if the queue is full, or a listener has closed the writer or has queued the
            message itself.
        """
        if not self.listeners.ask_listeners(message):
            return False
        writer.msgq_append(message)
        return True

    def next_id(self, last_id: int) -> int:
        """Return the id after ``last_id``, without 0 and the id that the interface shows at present."""
        return next_id(last_id, read_id(self.snapshot.block, self._id_offset))

    def next_id_is_stale(self, last_id: int) -> bool:  # noqa: ARG002 - only a Fawkes server's ids depend on it
        """Return False, because `next_id` skips 0 and the id that the interface shows."""
        return False


def make_received_message(
    instance: Interface,
    message_type: str,
    block: bytes,
    *,
    message_id: int,
    sender: UUID,
    source: UUID,
    hops: int,
    thread: str = UNKNOWN_THREAD,
) -> Message:
    """Return the message of a received block, with its envelope: ids, hops and thread.

    :param instance: an instance of the receiving interface.
    :param sender: the serial of the last sender.
    :param source: the serial of the first sender.
    :param hops: the number of crossed networks.
    :param thread: the name of the sending thread.
    :raises UnknownMessageTypeError: if the interface has no such message.
    :raises InterfaceError: if the size of the block is wrong.
    """
    message = instance.create_message(message_type)
    message.set_from_chunk(block)
    message.address(message_id, instance.mem_serial, sender, source)
    message.mark_foreign(hops, thread)
    return message
