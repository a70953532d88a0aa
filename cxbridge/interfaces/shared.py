"""The data half of an opened interface: a private copy of a shared block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Final
from uuid import UUID

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance_errors import BufferIndexError, TimestampError, WriteDeniedError
from cxbridge.interfaces.message import STAMP, ClosedPort, Port
from cxbridge.interfaces.schema import InterfaceSchema


class BufferedBlock(Block):
    """A data block with any number of private copies of itself, zero filled at first."""

    __slots__ = ("_buffers",)

    def __init__(self) -> None:
        super().__init__()
        self._buffers: list[bytearray] = []

    @property
    def num_buffers(self) -> int:
        """How many private buffers there are."""
        return len(self._buffers)

    def resize_buffers(self, count: int) -> None:
        """Have ``count`` private buffers; new ones are zero, the first ones keep their content."""
        fresh = range(len(self._buffers), count)
        self._buffers = self._buffers[:count] + [bytearray(len(self._buf)) for _ in fresh]

    def copy_private_to_buffer(self, buffer: int) -> None:
        """Copy the private copy into a buffer."""
        self._buffer(buffer)[:] = self._buf

    def compare_buffers(self, buffer: int) -> int:
        """Compare a buffer with the private copy as memcmp does: negative, 0 (equal) or positive."""
        data = self._buffer(buffer)
        return (data > self._buf) - (data < self._buf)

    def buffer_timestamp(self, buffer: int) -> int:
        """Return the time stamp of the block in a buffer, microseconds since the epoch."""
        seconds, microseconds = STAMP.unpack_from(self._buffer(buffer))
        return int(seconds) * MICROSECONDS + int(microseconds)

    def _buffer(self, index: int) -> bytearray:
        if not 0 <= index < len(self._buffers):
            raise BufferIndexError(self.SCHEMA.name, index, len(self._buffers))
        return self._buffers[index]


_NEVER_READ: Final = -1
_REPLACED: Final = -2


class SharedBlock(BufferedBlock):
    """A private copy of a shared block, opened for reading or for writing.

    :param port: the way to the shared block.
    :param id: the interface's id.
    :param owner: who opened it.
    :param serial: unique to this instance.
    :param writer: opened for writing.
    """

    __slots__ = (
        "_data_version",
        "_explicit_us",
        "_id",
        "_owner",
        "_port",
        "_read_changed",
        "_read_refreshed",
        "_serial",
        "_uid",
        "_version",
        "_writing",
    )

    SCHEMA: ClassVar[InterfaceSchema]
    """The definition that the class was made of."""

    def __init__(
        self,
        port: Port[Any],
        *,
        id: str,  # noqa: A002 - Fawkes' word
        owner: str,
        serial: UUID,
        writer: bool,
    ) -> None:
        """See the class."""
        super().__init__()
        self._port = port
        self._id = id
        self._uid = f"{self.SCHEMA.name}::{id}"
        self._owner = owner
        self._serial = serial
        self._writing = writer
        self._version = _NEVER_READ  # of the shared block that the private copy equals
        self._data_version = 0  # of the shared block at the last read
        self._read_refreshed = False
        self._read_changed = False
        self._explicit_us: int | None = None

    def __repr__(self) -> str:
        mode = "writing" if self._writing else "reading"
        return f"<{self._uid} opened for {mode} by {self._owner or 'nobody in particular'}>"

    def invalidate(self) -> None:
        """Cut it off its blackboard; for blackboards, when it is closed or its connection is lost."""
        self._port = ClosedPort(self._uid, self._serial)

    def adopt_serial(self, serial: UUID) -> None:
        """Take another serial; for blackboards that open it again after a lost connection."""
        self._serial = serial

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
        """Number of the shared memory on its blackboard, from 1; 0 when closed."""
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
        return self._writing

    @property
    def valid(self) -> bool:
        """Whether the interface is open and its blackboard is connected."""
        return not isinstance(self._port, ClosedPort)

    @property
    def has_writer(self) -> bool:
        """Whether an instance, perhaps this one, has the interface open for writing."""
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

    def reader_owner(self, serial: str) -> str:
        """Return the owner of the reader with this serial; empty when it is not known, as behind a Fawkes."""
        return self._port.reader_owner(serial)

    # -- reading and writing

    @property
    def version_read(self) -> int:
        """How often the shared block had been written at the last :meth:`read`."""
        return self._data_version

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
        if not self._writing:
            self._refreshed = self._changed = False
        return self._read_refreshed

    def write(self) -> None:
        """Publish the private copy; listeners are called before this returns, in this thread.

        When a setter was called since the last write, the block gets a new time stamp: the clock's, or the
        one set by hand with :attr:`auto_timestamping` off. Without, the old one goes out again.

        :raises WriteDeniedError: on a reader.
        :raises InvalidInstanceError: when it is closed.
        """
        if not self._writing:
            raise WriteDeniedError(self.type, self._id, "Cannot write.")
        changed = self._changed
        stamped: bool | None = self._refreshed
        self._refreshed = self._changed = False
        if stamped:
            now_us = self._port.now_us() if self._explicit_us is None else self._explicit_us
            STAMP.pack_into(self._buf, 0, now_us // MICROSECONDS, now_us % MICROSECONDS)
        elif self._version < 0:  # the block, time stamp included, does not come from the shared one
            stamped = None
        self._version = self._data_version = self._port.publish(self, self._buf, stamped, changed)

    def publish_block(self, block: bytes, stamped: bool | None, changed: bool) -> None:
        """Publish a block that was written in another process; for transports.

        :param stamped: it carries a new time stamp; None: only a comparison can tell.
        :param changed: a value changed since the write before.
        """
        self.set_from_chunk(block)
        self._port.publish(self, self._buf, stamped, changed)

    @property
    def refreshed(self) -> bool:
        """Whether there is something new.

        On a reader: between the last two calls of :meth:`read` the writer wrote a block with a new time
        stamp, that is, after setting a value, be it the same one. On a writer: a setter was called since the
        last write.
        """
        return self._refreshed if self._writing else self._read_refreshed

    @property
    def changed(self) -> bool:
        """Whether some value is another one; stricter than :attr:`refreshed`.

        On a reader: between the last two calls of :meth:`read` the writer wrote changed data (in Fawkes this
        is never so). On a writer: a setter changed a value since the last write.
        """
        return self._changed if self._writing else self._read_changed

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
        """Whether writes carry the clock's time; True by default."""
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
        if not self._writing:
            raise TimestampError("Timestamp can only be set on writing instance")
        self._explicit_us = self._port.now_us() if time_us is None else time_us
        self._refreshed = self._changed = True

    # -- private buffers: snapshots, e.g. of one loop

    def copy_shared_to_buffer(self, buffer: int) -> None:
        """Copy the shared block into a buffer; the private copy does not change."""
        self._port.fetch(self._buffer(buffer))

    def read_from_buffer(self, buffer: int) -> None:
        """Make the private copy equal a buffer; counts as a read for refreshed and changed."""
        data, local = self._buffer(buffer), bytes(self._buf)
        self._buf[:] = data
        self._version = _REPLACED
        self._read_refreshed = self._read_changed = False
        self._note_replaced(local)
