"""Messages of interfaces, their queues, and the port of instances to a blackboard."""
# ruff: noqa: SLF001 - a message sets attributes of its copy

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from typing import Any, ClassVar, Final, Protocol, Self, TypeVar
from uuid import UUID

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.block import STAMP, Block
from cxbridge.interfaces.instance_errors import (
    InvalidInstanceError,
    MessageAlreadyQueuedError,
    QueueFullError,
)
from cxbridge.interfaces.schema import InterfaceSchema, MessageSchema

InstanceT_contra = TypeVar("InstanceT_contra", contravariant=True)
"""The type of opened instances, :class:`~cxbridge.interfaces.instance.Interface`."""


class InstanceIdentity(Protocol):
    """The identity of an instance."""

    @property
    def uid(self) -> str:
        """The uid, ``Type::id``."""

    @property
    def serial(self) -> UUID:
        """The unique serial of the instance."""


class Port(Protocol[InstanceT_contra]):
    """The operations that an instance requests from its blackboard."""

    @property
    def version(self) -> int:
        """The number of writes of the shared block; read without a lock to skip useless reads."""

    @property
    def mem_serial(self) -> int:
        """The number of the shared memory on the blackboard."""

    def now_us(self) -> int:
        """Return the time of the blackboard's clock in microseconds since the epoch."""

    def fetch(self, target: bytearray) -> tuple[int, int, int]:
        """Copy the shared block.

        :returns: the versions of the last write, of the last time stamp and of the last changed data.
        """

    def publish(
        self, writer: InstanceIdentity, block: bytes | bytearray, stamped: bool | None, changed: bool
    ) -> int:
        """Copy the writer's private block to the shared block and notify the listeners.

        :param stamped: whether the time stamp is new; None if only a comparison of the blocks can tell.
        :param changed: whether a setter changed a value since the previous write.
        :returns: the new version.
        """

    def next_id(self, last_id: int) -> int:
        """Return the id of the next message of an instance.

        :param last_id: the id of the instance's last message, 0 before the first message.
        """

    def next_id_is_stale(self, last_id: int) -> bool:
        """Return whether the next message gets the id 0, or the id that the interface shows.

        :param last_id: the id of the instance's last message, 0 before the first message.
        """

    def transmit(self, sender: InstanceT_contra, message: Message) -> None:
        """Deliver an addressed message to the writer.

        :raises BlackBoardError: if there is no writer, or the writer cannot queue the message.
        """

    def writer_owner(self) -> str:
        """Return the owner of the writer, empty without a writer."""

    def has_writer(self) -> bool: ...

    def reader_owners(self) -> tuple[str, ...]:
        """Return the owners of the readers in the order of opening."""

    def reader_owner(self, serial: str) -> str:
        """Return the owner of the reader with a serial, empty if the serial is unknown."""

    def close(self, instance: InstanceT_contra) -> None:
        """Close the instance."""


_OPERATION_BY_METHOD: Final = {
    "now_us": "write()",
    "fetch": "read()",
    "publish": "write()",
    "next_id": "msgq_enqueue()",
    "next_id_is_stale": "msgq_enqueue()",
    "transmit": "msgq_enqueue()",
    "writer_owner": "writer()",
    "has_writer": "has_writer()",
    "reader_owners": "readers()",
    "reader_owner": "reader_owner()",
}
"""The operation of an instance, as in Fawkes' errors, by the method of the port that it calls."""


class ClosedPort:
    """The port of a closed instance, which refuses all operations except closing."""

    version = -3  # differs from the versions of all instances, so that read() calls fetch()
    mem_serial = 0

    def __init__(self, uid: str, serial: UUID) -> None:
        self._uid = uid
        self._serial = serial

    def __getattr__(self, method: str) -> Any:
        """Refuse a method of :class:`Port`."""
        if method in _OPERATION_BY_METHOD:
            raise InvalidInstanceError(self._uid, self._serial, _OPERATION_BY_METHOD[method])
        raise AttributeError(method)

    def close(self, instance: object) -> None:
        """Do nothing: closing twice is permitted."""


UNKNOWN_THREAD: Final = "Unknown"
"""The sender's thread name of a message from a network whose protocol has no thread names."""

MAX_HOPS: Final = 0xFFFFFFFF
"""The maximum hop count of the network protocols."""


class Message(Block):
    """A message to the writer of an interface; base of the classes made from XML definitions.

    :param values: the values of the fields in the order of declaration; the other fields are zero.
    :param by_name: further values by field name.
    :raises TypeError: if there are more values than fields.
    :raises InterfaceError: if a value does not fit, or there is no such field.
    """

    SCHEMA: ClassVar[MessageSchema]
    """The definition of the class."""

    INTERFACE: ClassVar[InterfaceSchema]
    """The definition of the message's interface."""

    __slots__ = (
        "enqueued",
        "hops",
        "id",
        "recipient",
        "sender_id",
        "sender_thread_name",
        "source_id",
    )

    def __init__(self, *values: Any, **by_name: Any) -> None:
        super().__init__()
        # `address`, `mark_foreign` and `mark_enqueued` set these attributes, for senders and transports
        self.id = 0
        """The 16-bit number among the messages of the sending instance; 0 before sending."""
        self.sender_id: UUID | None = None
        """The serial of the last sender; None before sending."""
        self.source_id: UUID | None = None
        """The serial of the first sender, kept by proxies; None before sending."""
        self.sender_thread_name = threading.current_thread().name
        """The name of the thread that made the message; `UNKNOWN_THREAD` if the network did not carry it."""
        self.recipient = 0
        """The memory serial of the receiving interface; 0 before sending."""
        self.enqueued = False
        """Whether the message is, or was, in a queue."""
        self.hops = 0
        """The number of networks that the message crossed."""
        if len(values) > len(self.ACCESSORS):
            raise TypeError(f"{self.type} has {len(self.ACCESSORS)} fields, not {len(values)}")
        # not strict, because the other fields stay zero
        for accessor, value in zip(self.ACCESSORS.values(), values, strict=False):
            accessor.fset(self, value)
        for name, value in by_name.items():
            self.set(name, value)

    @classmethod
    def belongs_to(cls, schema: InterfaceSchema) -> bool:
        """Return whether this is a message of an interface type, in the same version."""
        return cls.INTERFACE is schema or (
            cls.INTERFACE.name == schema.name and cls.INTERFACE.hash == schema.hash
        )

    @property
    def type(self) -> str:
        """The name of the type, e.g. ``ExecSkillMessage``."""
        return self.SCHEMA.name

    @property
    def time_enqueued_us(self) -> int:
        """The time of queueing in microseconds since the epoch, 0 before; the block's time stamp."""
        return self.timestamp_us

    def address(self, message_id: int, recipient: int, sender: UUID, source: UUID | None = None) -> None:
        """Set the envelope, on sending or on receiving by a transport.

        :param message_id: the id, a number of 16 bits.
        :param recipient: the memory serial of the interface.
        :param sender: the serial of the sending instance.
        :param source: the serial of the first sender; None keeps the present source, for proxies.
        """
        self.id = message_id
        self.recipient = recipient
        self.sender_id = sender
        if source is not None:
            self.source_id = source

    def mark_foreign(self, hops: int, thread_name: str = UNKNOWN_THREAD) -> None:
        """Mark the message as received over a network.

        :param hops: the number of networks that the message crossed.
        :param thread_name: the sender's thread, if the transport knows it.
        """
        self.hops = min(hops, MAX_HOPS)
        self.sender_thread_name = thread_name

    def mark_enqueued(self, time_us: int) -> None:
        """Mark the message as queued, with the time as its time stamp.

        :raises MessageAlreadyQueuedError: if the message was queued before.
        """
        if self.enqueued:
            raise MessageAlreadyQueuedError
        self.enqueued = True
        STAMP.pack_into(self._buf, 0, time_us // MICROSECONDS, time_us % MICROSECONDS)

    def copy(self) -> Self:
        """Return a copy with the same content and envelope. The copy has not been queued."""
        duplicate = type(self)()
        duplicate.set_from_chunk(self.to_bytes())
        STAMP.pack_into(duplicate._buf, 0, 0, 0)  # erases the time of queueing
        duplicate.id, duplicate.recipient = self.id, self.recipient
        duplicate.sender_id, duplicate.source_id = self.sender_id, self.source_id
        duplicate.sender_thread_name, duplicate.hops = self.sender_thread_name, self.hops
        return duplicate


# A writer processes its messages in each cycle: only a client that never stops sending reaches this limit.
MAX_WAITING: Final = 1024
"""The default maximum number of messages that wait for a writer."""


class MessageQueue:
    """A first in, first out queue of a writing instance. Thread-safe.

    :param uid: the interface, for error messages.
    :param limit: the maximum number of messages, by default `MAX_WAITING`.
    """

    __slots__ = ("_limit", "_lock", "_uid", "waiting")

    def __init__(self, uid: str, limit: int | None = None) -> None:
        self._uid = uid
        self._limit = MAX_WAITING if limit is None else limit
        self._lock = threading.Lock()
        self.waiting: Final[deque[Message]] = deque()
        """The messages; only to be tested for emptiness outside the queue."""

    def __len__(self) -> int:
        return len(self.waiting)

    def __iter__(self) -> Iterator[Message]:
        with self._lock:
            return iter(tuple(self.waiting))

    def enqueue(self, message: Message, time_us: int) -> None:
        """Append a message with a time stamp.

        :raises MessageAlreadyQueuedError: if the message is, or was, in a queue.
        :raises QueueFullError: if the queue is full.
        """
        with self._lock:
            if len(self.waiting) >= self._limit:
                raise QueueFullError(self._uid, self._limit)
            message.mark_enqueued(time_us)
            self.waiting.append(message)

    def first(self) -> Message | None:
        """Return the oldest message without removing it, or None."""
        with self._lock:
            return self.waiting[0] if self.waiting else None

    def pop(self) -> Message | None:
        """Remove and return the oldest message, or None."""
        if not self.waiting:  # in most cycles the queue is empty, and the lock is not needed
            return None
        with self._lock:
            return self.waiting.popleft() if self.waiting else None

    def remove(self, message: Message | int) -> bool:
        """Remove a message, or the oldest message with an id; return whether the queue contained it."""
        with self._lock:
            for index, queued_message in enumerate(self.waiting):
                if queued_message is message or (isinstance(message, int) and queued_message.id == message):
                    del self.waiting[index]
                    return True
        return False

    def flush(self) -> None:
        """Remove all messages."""
        with self._lock:
            self.waiting.clear()
