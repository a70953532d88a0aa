"""Opened interfaces: a private copy of a shared block and its connection to the blackboard.

A blackboard makes instances, and a :class:`Port` connects each instance to its shared memory. Only one thread
at a time may use an instance; different instances of an interface are independent. Names and semantics are
those of Fawkes (libs/interface); docs/blackboard.md lists the differences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar
from uuid import UUID

from cxbridge.closing import Closing
from cxbridge.interfaces.block import STAMP
from cxbridge.interfaces.instance_errors import (
    EnqueueDeniedError,
    ForeignMessageError,
    MessageAlreadyQueuedError,
    QueueAccessError,
    UnknownMessageTypeError,
)
from cxbridge.interfaces.message import Message, MessageQueue, Port
from cxbridge.interfaces.message_ids import MESSAGE_ID_MASK
from cxbridge.interfaces.shared import SharedBlock

__all__ = ["STAMP", "Interface", "Message", "MessageQueue", "Port"]


class Interface(SharedBlock, Closing):
    """An instance of an interface, opened for reading or for writing.

    A reader sends messages; the writer has their queue. All ``msgq_`` methods except ``msgq_enqueue`` and
    ``msgq_enqueue_copy`` raise :exc:`QueueAccessError` on a reader.

    :param port: the access to the shared memory.
    :param queue_limit: the maximum number of waiting messages, by default 1,024.
    """

    __slots__ = ("_last_message_id", "_queue")

    MESSAGES: ClassVar[Mapping[str, type[Message]]] = {}
    """The message classes by type name, e.g. ``ExecSkillMessage``."""

    def __init__(
        self,
        port: Port[Interface],
        *,
        id: str,  # noqa: A002 - Fawkes' word
        owner: str,
        serial: UUID,
        writer: bool,
        queue_limit: int | None = None,
    ) -> None:
        super().__init__(port, id=id, owner=owner, serial=serial, writer=writer)
        self._queue = MessageQueue(self.uid, queue_limit) if writer else None
        self._last_message_id = 0

    def close(self) -> None:
        """Close the instance; further calls do nothing."""
        self._port.close(self)

    def create_message(self, message_type: str, *values: Any) -> Message:
        """Return a new message by the name of its type, e.g. ``ExecSkillMessage``.

        :param values: the values of the first fields; the other fields are zero.
        :raises InterfaceError: if a value does not fit.
        :raises TypeError: if there are more values than fields.
        :raises UnknownMessageTypeError: if the interface has no such message.
        """
        message_class = self.MESSAGES.get(message_type)
        if message_class is None:
            raise UnknownMessageTypeError(message_type, tuple(self.MESSAGES))
        return message_class(*values)

    def msgq_enqueue(self, message: Message, *, proxy: bool = False, message_id: int | None = None) -> int:
        """Send ``message`` to the writer. A local blackboard puts the object itself into the writer's queue.

        :param proxy: whether to keep the source of another sender's message.
        :param message_id: the id of another sender's message; by default the next id.
        :returns: the message's id. This instance counts from 1 with 16 bits and leaves out 0 and the id that
            the interface shows, see :mod:`~cxbridge.interfaces.message_ids`. Fawkes' server assigns the ids
            itself, without gaps.
        :raises EnqueueDeniedError: on a writer.
        :raises ForeignMessageError: if the message belongs to another interface type.
        :raises MessageAlreadyQueuedError: if the message was queued before.
        :raises NoWriterError: if the interface has no writer.
        :raises QueueFullError: if the writer's queue is full.
        :raises InvalidInstanceError: if the instance is closed.
        """
        if self._queue is not None:
            raise EnqueueDeniedError(self.type, self.id)
        if message.INTERFACE is not self.SCHEMA and not message.belongs_to(self.SCHEMA):
            raise ForeignMessageError(message.type, self.type)
        if message.enqueued:
            raise MessageAlreadyQueuedError
        if message_id is None:
            message_id = self._port.next_id(self._last_message_id)
        # before sending: a message that fails may have arrived, and the next message must get another id
        self._last_message_id = message_id & MESSAGE_ID_MASK
        message.address(
            self._last_message_id, self._port.mem_serial, self.serial, None if proxy else self.serial
        )
        self._port.transmit(self, message)
        return message.id

    @property
    def next_id_is_stale(self) -> bool:
        """Whether the next message gets the id 0, or the id that the interface shows.

        True only if the server assigns the ids, see
        :func:`~cxbridge.blackboard.exclusive_control.skip_stale_ids`.
        """
        return self._port.next_id_is_stale(self._last_message_id)

    def msgq_enqueue_copy(self, message: Message) -> int:
        """Send a copy, and return its id. ``message`` gets the same id, and can be sent again."""
        copy = message.copy()
        message_id = self.msgq_enqueue(copy)
        message.address(message_id, copy.recipient, self.serial, self.serial)
        return message_id

    def msgq_append(self, message: Message) -> None:
        """Append a message to the queue of this writer without an event, for example in a listener."""
        # a writer uses its queue in each cycle: the usual case needs no call
        queue = self._queue if self._queue is not None else self._writer_queue("append")
        queue.enqueue(message, self._port.now_us())

    def divert_queue(self, queue: MessageQueue) -> None:
        """Replace the queue of incoming messages; for transports."""
        self._queue = queue

    def msgq_first(self) -> Message | None:
        """Return the oldest message without removing it, or None."""
        return self._writer_queue("first").first()

    def msgq_pop(self) -> Message | None:
        """Remove and return the oldest message, or None."""
        queue = self._queue if self._queue is not None else self._writer_queue("pop")
        return queue.pop()

    def msgq_remove(self, message: Message | int) -> bool:
        """Remove a message, or the oldest message with an id; return whether the queue contained it."""
        return self._writer_queue("remove id" if isinstance(message, int) else "remove msg").remove(message)

    def msgq_size(self) -> int:
        """Return the number of waiting messages."""
        return len(self._writer_queue("size"))

    def msgq_empty(self) -> bool:
        queue = self._queue if self._queue is not None else self._writer_queue("empty")
        return not queue.waiting

    def msgq_flush(self) -> None:
        """Remove all messages."""
        self._writer_queue("flush").flush()

    def msgq_iter(self) -> Iterator[Message]:
        """Iterate over the present messages from the oldest, without removing them."""
        return iter(self._writer_queue("begin"))

    def _writer_queue(self, operation: str) -> MessageQueue:
        """Return the queue.

        :param operation: Fawkes' word for the operation, for the error's text.
        :raises QueueAccessError: on a reader.
        """
        if self._queue is None:
            raise QueueAccessError(self.type, self.id, operation)
        return self._queue
