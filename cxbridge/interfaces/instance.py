"""An opened interface: a private copy of a shared block, and the way to and from the blackboard.

A blackboard makes instances, a :class:`Port` connects each to its shared memory. An instance may be used by
one thread at a time; different instances of one interface may be used by different threads without care.
Names and semantics are Fawkes' (libs/interface); what differs is listed in docs/blackboard.md.
"""

from __future__ import annotations

import builtins
from collections.abc import Iterator, Mapping, Sequence
from types import TracebackType
from typing import ClassVar, Final, Self, TypeVar
from uuid import UUID

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.buffered import BufferedBlock
from cxbridge.interfaces.instance_errors import (
    EnqueueDeniedError,
    InvalidMessageError,
    MessageAlreadyQueuedError,
    QueueAccessError,
    TimestampError,
    UnknownMessageTypeError,
    WriteDeniedError,
    WrongMessageError,
)
from cxbridge.interfaces.message import STAMP, Message, MessageQueue
from cxbridge.interfaces.port import ClosedPort, Port
from cxbridge.interfaces.schema import InterfaceSchema

__all__ = ["STAMP", "Interface", "Message", "MessageQueue", "Port"]

MESSAGE_ID_MASK: Final = 0xFFFF
"""Message ids have 16 bits: after 65535 comes 0."""

_NEVER_READ: Final = -1
_REPLACED: Final = -2

M = TypeVar("M", bound=Message)


class Interface(BufferedBlock):
    """An instance of an interface, opened for reading or for writing.

    The classes made of XML definitions derive from it; a blackboard makes the instances.

    :param port: the way to the shared memory.
    :param id: the interface's id.
    :param owner: who opened it.
    :param serial: unique to this instance.
    :param writer: opened for writing.
    :param queue_limit: how many messages may wait for a writer; None: any number.
    """

    __slots__ = (
        "_data_version",
        "_explicit_us",
        "_id",
        "_last_message_id",
        "_owner",
        "_port",
        "_queue",
        "_read_changed",
        "_read_refreshed",
        "_serial",
        "_uid",
        "_version",
    )

    SCHEMA: ClassVar[InterfaceSchema]
    """The definition that the class was made of."""

    MESSAGES: ClassVar[Mapping[str, builtins.type[Message]]] = {}
    """Message classes by type name, e.g. ``ExecSkillMessage``."""

    def __init__(
        self,
        port: Port,
        *,
        id: str,  # noqa: A002 - Fawkes' word
        owner: str,
        serial: UUID,
        writer: bool,
        queue_limit: int | None = None,
    ) -> None:
        """See the class."""
        super().__init__()
        self._port = port
        self._id = id
        self._uid = f"{self.SCHEMA.name}::{id}"
        self._owner = owner
        self._serial = serial
        self._queue = MessageQueue(self._uid, queue_limit) if writer else None
        self._version = _NEVER_READ  # of the shared block that the private copy equals
        self._data_version = 0  # of the shared block at the last read
        self._read_refreshed = False
        self._read_changed = False
        self._explicit_us: int | None = None
        self._last_message_id = 0

    def __repr__(self) -> str:
        mode = "writing" if self.is_writer else "reading"
        return f"<{self._uid} opened for {mode} by {self._owner or 'nobody in particular'}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: builtins.type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    # -- who it is

    @property
    def type(self) -> str:
        """Name of the interface type, e.g. ``SkillerInterface``."""
        return self.SCHEMA.name

    @property
    def id(self) -> str:
        """Id of the interface among those of its type."""
        return self._id

    @property
    def uid(self) -> str:
        """``Type::id``."""
        return self._uid

    @property
    def serial(self) -> UUID:
        """Unique to this instance; messages carry it as their sender."""
        return self._serial

    @property
    def mem_serial(self) -> int:
        """Number of the shared memory on its blackboard."""
        return self._port.mem_serial

    @property
    def hash(self) -> bytes:
        """Version of the interface type: 16 bytes, the MD5 of its definition."""
        return self.SCHEMA.hash

    @property
    def owner(self) -> str:
        """Who opened this instance."""
        return self._owner

    @property
    def is_writer(self) -> bool:
        """Whether it was opened for writing."""
        return self._queue is not None

    @property
    def valid(self) -> bool:
        """Whether it is open and its blackboard is there."""
        return not isinstance(self._port, ClosedPort)

    @property
    def has_writer(self) -> bool:
        """Whether somebody, perhaps this instance, has the interface open for writing."""
        return self._port.has_writer()

    @property
    def num_readers(self) -> int:
        """How many have the interface open for reading, this instance included."""
        return len(self._port.reader_owners())

    @property
    def writer(self) -> str:
        """Owner of the writer; empty when there is none."""
        return self._port.writer_owner()

    @property
    def readers(self) -> tuple[str, ...]:
        """Owners of the readers, in the order of opening."""
        return self._port.reader_owners()

    # -- reading and writing

    def read(self) -> bool:
        """Make the private copy equal the shared block; cheap when nothing was written since.

        Values that were set here and not written are lost.

        :returns: whether it was refreshed: see :attr:`refreshed`.
        :raises InvalidInstanceError: when it is closed.
        """
        port = self._port
        if port.version == self._version and not self._refreshed:
            self._read_refreshed = self._read_changed = False
            return False
        local = bytes(self._buf) if self._version == _REPLACED else None
        version, stamped, changed = port.fetch(self._buf)
        self._read_refreshed = stamped > self._data_version
        self._read_changed = changed > self._data_version
        if local is not None:
            self._note_replaced(local)
        self._version = self._data_version = version
        if self._queue is None:
            self._refreshed = self._changed = False
        return self._read_refreshed

    def write(self) -> None:
        """Publish the private copy; listeners are told before this returns, in this thread.

        When a setter was called since the last write, the block gets a new time stamp: the clock's, or the
        one set by hand with :attr:`auto_timestamping` off. Without, the old one goes out again.

        :raises WriteDeniedError: on a reader.
        :raises InvalidInstanceError: when it is closed.
        """
        if self._queue is None:
            raise WriteDeniedError(self.type, self._id, "Cannot write.")
        stamped, changed = self._refreshed, self._changed
        self._refreshed = self._changed = False
        if stamped:
            now_us = self._port.now_us() if self._explicit_us is None else self._explicit_us
            STAMP.pack_into(self._buf, 0, now_us // MICROSECONDS, now_us % MICROSECONDS)
        self._version = self._data_version = self._port.publish(self, self._buf, stamped, changed)

    @property
    def refreshed(self) -> bool:
        """Whether there is something new.

        On a reader: between the last two calls of :meth:`read` somebody wrote a block with a new time stamp,
        that is, after setting a value, be it the same one. On a writer: a setter was called since the
        last write.
        """
        return self._refreshed if self._queue is not None else self._read_refreshed

    @property
    def changed(self) -> bool:
        """Whether some value is another one; stricter than :attr:`refreshed`.

        On a reader: between the last two calls of :meth:`read` somebody wrote changed data (in Fawkes this is
        never so). On a writer: a setter changed a value since the last write.
        """
        return self._changed if self._queue is not None else self._read_changed

    def mark_data_refreshed(self) -> None:
        """Let the next write carry a new time stamp even if no setter is called."""
        self._refreshed = True

    def mark_data_changed(self) -> None:
        """Let the next write raise a changed event even if no setter changes anything; for transports."""
        self._changed = True

    def set_from_chunk(self, chunk: bytes | bytearray | memoryview | Sequence[int]) -> None:
        """Replace the private copy, time stamp included; raises no flag."""
        super().set_from_chunk(chunk)
        self._version = _REPLACED

    def _note_replaced(self, local: bytes) -> None:
        """Add to the flags of a read what differs from a private copy that no read has brought."""
        head = STAMP.size
        self._read_refreshed |= local[:head] != self._buf[:head]
        self._read_changed |= local[head:] != self._buf[head:]

    # -- time stamps

    @property
    def auto_timestamping(self) -> bool:
        """Whether writes carry the clock's time; on unless somebody sets it to False."""
        return self._explicit_us is None

    @auto_timestamping.setter
    def auto_timestamping(self, on: bool) -> None:
        self._explicit_us = None if on else self.timestamp_us

    @property
    def timestamp_us(self) -> int:
        """Time stamp of the private copy, microseconds since the epoch; setting is :meth:`set_timestamp`."""
        return super().timestamp_us

    @timestamp_us.setter
    def timestamp_us(self, time_us: int) -> None:
        self.set_timestamp(time_us)

    def set_timestamp(self, time_us: int | None = None) -> None:
        """Set the time stamp of the next write by hand; it counts as refreshed and changed data.

        :param time_us: microseconds since the epoch; None: the clock's time now.
        :raises TimestampError: on a reader, or when :attr:`auto_timestamping` is on.
        """
        if self._explicit_us is None:
            raise TimestampError("Auto timestamping enabled, cannot set explicit timestamp")
        if self._queue is None:
            raise TimestampError("Timestamp can only be set on writing instance")
        self._explicit_us = self._port.now_us() if time_us is None else time_us
        self._refreshed = self._changed = True

    # -- messages: a reader sends, the writer has the queue

    def create_message(self, message_type: str) -> Message:
        """Make an empty message of this interface by its type's name, e.g. ``ExecSkillMessage``.

        :raises UnknownMessageTypeError: when the interface has none of this name.
        """
        message_class = self.MESSAGES.get(message_type)
        if message_class is None:
            raise UnknownMessageTypeError(message_type, tuple(self.MESSAGES))
        return message_class()

    def msgq_enqueue(self, message: Message, *, proxy: bool = False) -> int:
        """Send ``message`` to the writer; the object itself goes into its queue.

        :param proxy: pass on somebody else's message: its source stays.
        :returns: the message's id: counted by this instance from 1, 16 bit wide, then 0.
        :raises EnqueueDeniedError: on a writer.
        :raises InvalidMessageError: when the message belongs to another interface type.
        :raises MessageAlreadyQueuedError: when it was sent before.
        :raises NoWriterError: when nobody has the interface open for writing.
        """
        if self._queue is not None:
            raise EnqueueDeniedError(self.type, self._id)
        known = self.MESSAGES.get(message.type)
        if known is None or not isinstance(message, known):
            raise InvalidMessageError(message.type, self.type)
        if message.enqueued:
            raise MessageAlreadyQueuedError
        self._last_message_id = (self._last_message_id + 1) & MESSAGE_ID_MASK
        source = None if proxy else self._serial
        message.address(self._last_message_id, self._port.mem_serial, self._serial, source)
        self._port.transmit(self, message)
        return message.id

    def msgq_enqueue_copy(self, message: Message) -> int:
        """Send a copy; ``message`` gets the copy's id and can be sent again."""
        twin = message.copy()
        message_id = self.msgq_enqueue(twin)
        message.address(message_id, twin.recipient, self._serial, self._serial)
        return message_id

    def msgq_append(self, message: Message) -> None:
        """Put a message into this writer's own queue, for example from a listener; nobody is told."""
        self._writer_queue("append").append(message, self._port.now_us())

    def msgq_first(self) -> Message | None:
        """Return the oldest message and leave it in the queue; None when there is none."""
        return self._writer_queue("first").first()

    def msgq_first_is(self, message_class: builtins.type[Message]) -> bool:
        """Return whether there is a message and the oldest is of this class."""
        return isinstance(self._writer_queue("first").first(), message_class)

    def msgq_first_as(self, message_class: builtins.type[M]) -> M | None:
        """Return the oldest message as one of ``message_class``; None when there is none.

        :raises WrongMessageError: when it is of another class.
        """
        message = self._writer_queue("first").first()
        if message is None or isinstance(message, message_class):
            return message
        raise WrongMessageError

    def msgq_pop(self) -> Message | None:
        """Take the oldest message out of the queue and return it; None when there is none."""
        return self._writer_queue("pop").pop()

    def msgq_remove(self, message: Message | int) -> bool:
        """Take a message, or the oldest of this id, out of the queue; tell whether it was there."""
        operation = "remove id" if isinstance(message, int) else "remove msg"
        return self._writer_queue(operation).remove(message)

    def msgq_size(self) -> int:
        """Return how many messages wait."""
        return len(self._writer_queue("size"))

    def msgq_empty(self) -> bool:
        """Return whether no message waits."""
        return not self._writer_queue("empty")

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

    # -- private buffers: snapshots, e.g. of one loop

    def copy_shared_to_buffer(self, buffer: int) -> None:
        """Copy the shared block into a buffer; the private copy stays as it is."""
        self._port.fetch(self._buffer(buffer))

    def read_from_buffer(self, buffer: int) -> None:
        """Make the private copy equal a buffer; counts as a read for refreshed and changed."""
        data, local = self._buffer(buffer), bytes(self._buf)
        self._buf[:] = data
        self._version = _REPLACED
        self._read_refreshed = self._read_changed = False
        self._note_replaced(local)

    # -- the end

    def close(self) -> None:
        """Take it off the blackboard; closing twice is no error."""
        self._port.close(self)

    def invalidate(self) -> None:
        """Cut it off its blackboard; for blackboards, when it is closed or its connection is lost."""
        self._port = ClosedPort(self)
