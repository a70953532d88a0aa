"""Messages of interfaces, their queues, and the port by which a blackboard carries them."""
# ruff: noqa: ARG002, SLF001 - the closed port repeats the open one; a message fills in its copy

from __future__ import annotations

import struct
import threading
from collections import deque
from collections.abc import Iterator
from typing import Any, ClassVar, Final, Protocol, Self, TypeVar
from uuid import UUID

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.accessors import MISFITS, Fill, fill_nothing
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance_errors import (
    InvalidInstanceError,
    MessageAlreadyQueuedError,
    QueueFullError,
)
from cxbridge.interfaces.schema import InterfaceSchema, MessageSchema

InstanceT_contra = TypeVar("InstanceT_contra", contravariant=True)
"""The type of the instances that a blackboard opens: :class:`~cxbridge.interfaces.instance.Interface`."""


class OpenedBlock(Protocol):
    """The identity of an instance."""

    @property
    def uid(self) -> str:
        """``Type::id``."""

    @property
    def serial(self) -> UUID:
        """Unique to the instance."""


class Port(Protocol[InstanceT_contra]):
    """What an instance asks of the blackboard that opened it."""

    @property
    def version(self) -> int:
        """How often the shared block was written. Read without a lock, to see whether a read is worth it."""

    @property
    def mem_serial(self) -> int:
        """Number of the shared memory on its blackboard."""

    def now_us(self) -> int:
        """Return the time of the blackboard's clock, microseconds since the epoch."""

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        """Copy the shared block.

        :returns: its version, the version that last got a time stamp, the version that last had changed data.
        """

    def publish(self, writer: OpenedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        """Copy the writer's private block to the shared one and notify the listeners.

        :param block: the private block, of the size of the shared one.
        :param stamped: the block carries a new time stamp; None: only a comparison can tell.
        :param changed: a setter changed a value since the write before.
        :returns: the new version.
        """

    def next_id(self, last: int) -> int:
        """Return the id of the next message of an instance.

        :param last: the id of its last one; 0: there was none.
        """

    def next_id_is_stale(self, last: int) -> bool:
        """Return whether the next message gets an id that is not a message's, or an earlier one's.

        :param last: the id of the instance's last one; 0: there was none.
        """

    def transmit(self, sender: InstanceT_contra, message: Message) -> None:
        """Carry an addressed message to the writer.

        :raises BlackBoardError: when there is no writer, or it cannot take the message.
        """

    def writer_owner(self) -> str:
        """Return the name of the writer of the interface; empty without a writer."""

    def has_writer(self) -> bool:
        """Return whether the interface has a writer."""

    def reader_owners(self) -> tuple[str, ...]:
        """Return who has the interface open for reading, in the order of opening."""

    def reader_owner(self, serial: str) -> str:
        """Return who has opened the reading instance with this serial; empty when that is not known."""

    def close(self, instance: InstanceT_contra) -> None:
        """Take the instance off the blackboard."""


class ClosedPort:
    """The port of an instance that is closed: refuses everything but closing."""

    __slots__ = ("_serial", "_uid")

    version = -3  # equal to no instance's: a read always comes to fetch
    mem_serial = 0

    def __init__(self, uid: str, serial: UUID) -> None:
        self._uid = uid
        self._serial = serial

    def _refuse(self, operation: str) -> InvalidInstanceError:
        return InvalidInstanceError(self._uid, self._serial, operation)

    def now_us(self) -> int:
        raise self._refuse("write()")

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        raise self._refuse("read()")

    def publish(self, writer: OpenedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        raise self._refuse("write()")

    def next_id(self, last: int) -> int:
        raise self._refuse("msgq_enqueue()")

    def next_id_is_stale(self, last: int) -> bool:
        raise self._refuse("msgq_enqueue()")

    def transmit(self, sender: object, message: Message) -> None:
        raise self._refuse("msgq_enqueue()")

    def writer_owner(self) -> str:
        raise self._refuse("writer()")

    def has_writer(self) -> bool:
        raise self._refuse("has_writer()")

    def reader_owners(self) -> tuple[str, ...]:
        raise self._refuse("readers()")

    def reader_owner(self, serial: str) -> str:
        raise self._refuse("reader_owner()")

    def close(self, instance: object) -> None:
        pass


STAMP: Final = struct.Struct("=qq")
"""The head of each data block: seconds and microseconds since the epoch, in the host's byte order."""

UNKNOWN_THREAD: Final = "Unknown"
"""Sender thread name of a message that came over a network."""

MAX_HOPS: Final = 0xFFFFFFFF
"""More networks than this cannot be announced on any of them."""


class Message(Block):
    """A message to the writer of an interface; the classes made of an XML definition derive from it.

    :param values: the fields' values in the order of declaration; those not given stay zero.
    :param named: more values, by field name.
    """

    SCHEMA: ClassVar[MessageSchema]
    """The definition that the class was made of."""

    INTERFACE: ClassVar[InterfaceSchema]
    """The definition of the interface that the message belongs to."""

    FILL: ClassVar[Fill] = fill_nothing
    """Sets all fields at once, where that is possible; made by ``accessors.make_filler``."""

    __slots__ = (
        "_enqueued",
        "_hops",
        "_id",
        "_recipient",
        "_sender_id",
        "_sender_thread_name",
        "_source_id",
    )

    def __init__(self, *values: Any, **named: Any) -> None:
        super().__init__()
        self._id = 0
        self._sender_id: UUID | None = None
        self._source_id: UUID | None = None
        self._sender_thread_name = threading.current_thread().name
        self._recipient = 0
        self._enqueued = False
        self._hops = 0
        if values:
            self._take(values)
        for name, value in named.items():
            self.set(name, value)

    def _take(self, values: tuple[Any, ...]) -> None:
        """Set the first fields."""
        fields = self.SCHEMA.fields
        if len(values) == len(fields):
            try:
                self.FILL(values)
            except MISFITS:
                pass  # the setters convert the values, or raise the error
            else:
                return
        if len(values) > len(fields):
            raise TypeError(f"{self.type} has {len(fields)} fields, not {len(values)}")
        for field, value in zip(fields, values, strict=False):
            self.set(field.name, value)

    @classmethod
    def belongs_to(cls, schema: InterfaceSchema) -> bool:
        """Return whether it is a message of this interface type, in this version of its definition."""
        return cls.INTERFACE is schema or (
            cls.INTERFACE.name == schema.name and cls.INTERFACE.hash == schema.hash
        )

    @property
    def type(self) -> str:
        """Type name, e.g. ``ExecSkillMessage``."""
        return self.SCHEMA.name

    @property
    def id(self) -> int:
        """Number that the sending instance gave it: 16 bit, from 1; 0 before it was sent."""
        return self._id

    @property
    def sender_id(self) -> UUID | None:
        """Serial of the instance that sent it last; None before it was sent."""
        return self._sender_id

    @property
    def source_id(self) -> UUID | None:
        """Serial of the instance that sent it first, kept across proxies; None before it was sent."""
        return self._source_id

    @property
    def sender_thread_name(self) -> str:
        """Name of the thread that made it; :data:`UNKNOWN_THREAD` when it came over a network."""
        return self._sender_thread_name

    @sender_thread_name.setter
    def sender_thread_name(self, name: str) -> None:
        self._sender_thread_name = name

    @property
    def recipient(self) -> int:
        """Memory serial of the interface that it was sent to; 0 before it was sent."""
        return self._recipient

    @property
    def enqueued(self) -> bool:
        """Whether it is, or was, in a queue."""
        return self._enqueued

    @property
    def time_enqueued_us(self) -> int:
        """When it came into a queue, microseconds since the epoch; 0 before. The block's time stamp."""
        return self.timestamp_us

    @property
    def hops(self) -> int:
        """How many networks it crossed."""
        return self._hops

    def address(self, message_id: int, recipient: int, sender: UUID, source: UUID | None = None) -> None:
        """Write the envelope; an instance does it when it sends, a transport when it receives.

        :param message_id: 16 bit.
        :param recipient: memory serial of the interface.
        :param sender: serial of the sending instance.
        :param source: serial of the first sender; None: keep the one it has (a proxy passes it on).
        """
        self._id = message_id
        self._recipient = recipient
        self._sender_id = sender
        if source is not None:
            self._source_id = source

    def mark_foreign(self, hops: int, thread_name: str = UNKNOWN_THREAD) -> None:
        """Note that it came over a network.

        :param hops: how many networks it has crossed.
        :param thread_name: of the thread that sent it, if the wire has it.
        """
        self._hops = min(hops, MAX_HOPS)
        self._sender_thread_name = thread_name

    def mark_enqueued(self, time_us: int) -> None:
        """Note when it came into a queue; the time goes into the block's time stamp.

        :raises MessageAlreadyQueuedError: when it has been in a queue before.
        """
        if self._enqueued:
            raise MessageAlreadyQueuedError
        self._enqueued = True
        STAMP.pack_into(self._buf, 0, time_us // MICROSECONDS, time_us % MICROSECONDS)

    def copy(self) -> Self:
        """Return a message of the same content and envelope that is in no queue."""
        twin = type(self)()
        twin.set_from_chunk(self.to_bytes())
        STAMP.pack_into(twin._buf, 0, 0, 0)
        twin._id, twin._recipient = self._id, self._recipient
        twin._sender_id, twin._source_id = self._sender_id, self._source_id
        twin._sender_thread_name, twin._hops = self._sender_thread_name, self._hops
        return twin


MOST_WAITING: Final = 1024
"""Messages that wait for a writer at most, unless it is opened with another ``queue_limit``.

A writer takes all its messages in each loop. Only clients that send without an end reach the limit.
"""


class MessageQueue:
    """First in, first out; owned by a writing instance. Safe to use from several threads.

    :param uid: of the interface, for messages to people.
    :param limit: how many messages it holds at most; None: :data:`MOST_WAITING`.
    """

    __slots__ = ("_limit", "_lock", "_uid", "waiting")

    def __init__(self, uid: str, limit: int | None = None) -> None:
        self._uid = uid
        self._limit = MOST_WAITING if limit is None else limit
        self._lock = threading.Lock()
        self.waiting: Final[deque[Message]] = deque()
        """The messages. To see whether there are any; all else goes through the methods."""

    def __len__(self) -> int:
        return len(self.waiting)

    def __iter__(self) -> Iterator[Message]:
        with self._lock:
            return iter(tuple(self.waiting))

    def append(self, message: Message, time_us: int) -> None:
        """Put ``message`` at the end, stamped with ``time_us``.

        :raises MessageAlreadyQueuedError: when it is, or was, in a queue.
        :raises QueueFullError: when the queue is full.
        """
        with self._lock:
            if len(self.waiting) >= self._limit:
                raise QueueFullError(self._uid, self._limit)
            message.mark_enqueued(time_us)
            self.waiting.append(message)

    def first(self) -> Message | None:
        """Return the oldest message and leave it there; None when there is none."""
        with self._lock:
            return self.waiting[0] if self.waiting else None

    def pop(self) -> Message | None:
        """Take the oldest message out and return it; None when there is none."""
        if not self.waiting:  # most loops: no lock for an empty queue
            return None
        with self._lock:
            return self.waiting.popleft() if self.waiting else None

    def remove(self, message: Message | int) -> bool:
        """Take out ``message``, or the oldest one that has this id; return whether the queue had it."""
        with self._lock:
            for index, queued in enumerate(self.waiting):
                if queued is message or (isinstance(message, int) and queued.id == message):
                    del self.waiting[index]
                    return True
        return False

    def flush(self) -> None:
        """Take all messages out."""
        with self._lock:
            self.waiting.clear()
