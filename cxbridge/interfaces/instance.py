"""An opened interface: a private copy of a shared block, and the way to and from the blackboard.

A blackboard makes instances, a :class:`Port` connects each to its shared memory. An instance may be used by
one thread at a time; different instances of one interface may be used by different threads without care.
Names and semantics are Fawkes' (libs/interface); what differs is listed in docs/blackboard.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Any, ClassVar, Self, TypeGuard, TypeVar
from uuid import UUID

from cxbridge.interfaces.instance_errors import (
    EnqueueDeniedError,
    InvalidMessageError,
    MessageAlreadyQueuedError,
    QueueAccessError,
    UnknownMessageTypeError,
    WrongMessageError,
)
from cxbridge.interfaces.message import STAMP, Message, MessageQueue, Port
from cxbridge.interfaces.message_ids import MESSAGE_ID_MASK
from cxbridge.interfaces.shared import SharedBlock

__all__ = ["STAMP", "Interface", "Message", "MessageQueue", "Port"]

M = TypeVar("M", bound=Message)


class Interface(SharedBlock):
    """An instance of an interface, opened for reading or for writing.

    The classes made of XML definitions derive from it; a blackboard makes the instances. It has its data from
    :class:`~cxbridge.interfaces.shared.SharedBlock`; a reader sends messages, the writer has their queue.

    :param port: the way to the shared memory.
    :param id: the interface's id.
    :param owner: who opened it.
    :param serial: unique to this instance.
    :param writer: opened for writing.
    :param queue_limit: how many messages may wait for a writer; None: 1,024.
    """

    __slots__ = ("_last_message_id", "_queue")

    MESSAGES: ClassVar[Mapping[str, type[Message]]] = {}
    """Message classes by type name, e.g. ``ExecSkillMessage``."""

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
        """See the class."""
        super().__init__(port, id=id, owner=owner, serial=serial, writer=writer)
        self._queue = MessageQueue(self._uid, queue_limit) if writer else None
        self._last_message_id = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Take it off the blackboard; closing twice is not an error."""
        self._port.close(self)

    def create_message(self, message_type: str, *values: Any) -> Message:
        """Make a message of this interface by its type's name, e.g. ``ExecSkillMessage``.

        :param values: of its first fields; those not given stay zero.
        :raises InterfaceError: when a value does not fit.
        :raises UnknownMessageTypeError: when the interface has none of this name.
        """
        message_class = self.MESSAGES.get(message_type)
        if message_class is None:
            raise UnknownMessageTypeError(message_type, tuple(self.MESSAGES))
        return message_class(*values)

    def msgq_enqueue(self, message: Message, *, proxy: bool = False, message_id: int | None = None) -> int:
        """Send ``message`` to the writer; the object itself goes into its queue.

        :param proxy: pass on a message of another sender: its source stays.
        :param message_id: the number that the other sender gave; None: count.
        :returns: the message's id: counted by this instance from 1, 16 bit wide; never 0, and never the id
            that the interface shows when it is sent (see :mod:`~cxbridge.interfaces.message_ids`). A remote
            Fawkes counts by itself, and leaves out neither.
        :raises EnqueueDeniedError: on a writer.
        :raises InvalidMessageError: when the message belongs to another interface type.
        :raises MessageAlreadyQueuedError: when it was sent before.
        :raises NoWriterError: when no instance has the interface open for writing.
        """
        if self._queue is not None:
            raise EnqueueDeniedError(self.type, self._id)
        if message.INTERFACE is not self.SCHEMA and not message.belongs_to(self.SCHEMA):
            raise InvalidMessageError(message.type, self.type)
        if message.enqueued:
            raise MessageAlreadyQueuedError
        if message_id is None:
            message_id = self._port.next_id(self._last_message_id)
        self._last_message_id = message_id & MESSAGE_ID_MASK
        source = None if proxy else self._serial
        message.address(self._last_message_id, self._port.mem_serial, self._serial, source)
        self._port.transmit(self, message)
        return message.id

    @property
    def next_id_is_stale(self) -> bool:
        """Whether the next message gets an id that is not a message's, or an earlier one's.

        Only where the other end counts; see :func:`~cxbridge.blackboard.stale_ids.skip_stale_ids`.
        """
        return self._port.next_id_is_stale(self._last_message_id)

    def msgq_enqueue_copy(self, message: Message) -> int:
        """Send a copy; ``message`` gets the copy's id and can be sent again."""
        twin = message.copy()
        message_id = self.msgq_enqueue(twin)
        message.address(message_id, twin.recipient, self._serial, self._serial)
        return message_id

    def msgq_append(self, message: Message) -> None:
        """Put a message into this writer's own queue, for example from a listener; no event is delivered."""
        queue = self._queue if self._queue is not None else self._writer_queue("append")
        queue.append(message, self._port.now_us())

    def divert_queue(self, queue: MessageQueue) -> None:
        """Put incoming messages of this writer into another queue; for transports."""
        self._queue = queue

    def msgq_first(self) -> Message | None:
        """Return the oldest message and leave it in the queue; None when there is none."""
        return self._writer_queue("first").first()

    def msgq_first_is(self, message_class: type[Message]) -> bool:
        """Return whether there is a message and the oldest is of this class, or of one of its definition."""
        message = self._writer_queue("first").first()
        return message is not None and _is_a(message, message_class)

    def msgq_first_as(self, message_class: type[M]) -> M | None:
        """Return the oldest message as one of ``message_class``; None when there is none.

        :raises WrongMessageError: when it is of another class.
        """
        message = self._writer_queue("first").first()
        if message is None:
            return None
        if _is_a(message, message_class):
            return message
        raise WrongMessageError

    def msgq_pop(self) -> Message | None:
        """Take the oldest message out of the queue and return it; None when there is none."""
        queue = self._queue if self._queue is not None else self._writer_queue("pop")
        return queue.pop()

    def msgq_remove(self, message: Message | int) -> bool:
        """Remove a message, or the oldest of this id, from the queue; return whether the queue had it."""
        operation = "remove id" if isinstance(message, int) else "remove msg"
        return self._writer_queue(operation).remove(message)

    def msgq_size(self) -> int:
        """Return how many messages wait."""
        return len(self._writer_queue("size"))

    def msgq_empty(self) -> bool:
        """Return whether no message waits."""
        queue = self._queue if self._queue is not None else self._writer_queue("empty")
        return not queue.waiting

    def msgq_flush(self) -> None:
        """Drop all messages that wait."""
        self._writer_queue("flush").flush()

    def msgq_iter(self) -> Iterator[Message]:
        """Iterate over the messages that wait now, oldest first; they stay in the queue."""
        return iter(self._writer_queue("begin"))

    def _writer_queue(self, operation: str) -> MessageQueue:
        if self._queue is None:
            raise QueueAccessError(self.type, self._id, operation)
        return self._queue


def _is_a(message: Message, message_class: type[M]) -> TypeGuard[M]:
    """Return whether a message is of this class, or of another class that was made of the same definition."""
    return isinstance(message, message_class) or (
        message.type == message_class.SCHEMA.name and message_class.belongs_to(message.INTERFACE)
    )
