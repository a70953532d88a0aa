"""The data of an opened interface: a private copy of a shared block.

Reads and writes copy between the private and the shared block. The version of a shared block is the number of
its writes. The block also has the versions of its last new time stamp and of its last changed value; a reader
compares both with the version of its last read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Final
from uuid import UUID

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.block import STAMP, Block
from cxbridge.interfaces.instance_errors import TimestampError, WriteDeniedError
from cxbridge.interfaces.message import ClosedPort, Port
from cxbridge.interfaces.schema import InterfaceSchema

_NEVER_READ: Final = -1
# The private copy was replaced since the last read: it equals no version of the shared block.
_COPY_REPLACED: Final = -2


class SharedBlock(Block):
    """A private copy of a shared block, opened for reading or for writing.

    After closing, `has_writer`, `num_readers`, `writer`, `readers` and `reader_owner` raise
    :exc:`InvalidInstanceError`.

    :param serial: unique to this instance.
    """

    __slots__ = (
        "_explicit_stamp_us",
        "_port",
        "_read_changed",
        "_read_refreshed",
        "_read_version",
        "_version",
        "id",
        "is_writer",
        "owner",
        "serial",
        "uid",
    )

    SCHEMA: ClassVar[InterfaceSchema]
    """The definition of the class."""

    def __init__(
        self,
        port: Port[Any],
        *,
        id: str,  # noqa: A002 - Fawkes' word
        owner: str,
        serial: UUID,
        writer: bool,
    ) -> None:
        super().__init__()
        self._port = port
        self.id: Final = id
        """The id of the interface among those of its type."""
        self.uid: Final = f"{self.SCHEMA.name}::{id}"
        """The uid, ``Type::id``."""
        self.owner: Final = owner
        """The name given on opening."""
        self.serial = serial
        """The unique serial of the instance, the sender of its messages."""
        self.is_writer: Final = writer
        """Whether the instance was opened for writing."""
        self._version = _NEVER_READ  # the version of the shared block that the private copy equals
        self._read_version = 0  # the version of the shared block at the last read or write
        self._read_refreshed = False
        self._read_changed = False
        self._explicit_stamp_us: int | None = None

    def __repr__(self) -> str:
        mode = "writing" if self.is_writer else "reading"
        return f"<{self.uid} opened for {mode} by {self.owner or 'an owner without a name'}>"

    def invalidate(self) -> None:
        """Disconnect the instance; blackboards call this method on closing and after a lost connection."""
        self._port = ClosedPort(self.uid, self.serial)

    def adopt_serial(self, serial: UUID) -> None:
        """Replace the serial. Blackboards call this method when they reopen an instance after a loss."""
        self.serial = serial

    @property
    def type(self) -> str:
        """The name of the interface type, e.g. ``SkillerInterface``."""
        return self.SCHEMA.name

    @property
    def mem_serial(self) -> int:
        """The number of the shared memory on the blackboard, from 1; 0 after closing."""
        return self._port.mem_serial

    @property
    def hash(self) -> bytes:
        """The version of the interface type: the MD5 of its definition, 16 bytes."""
        return self.SCHEMA.hash

    @property
    def valid(self) -> bool:
        """Whether the instance is open and its blackboard connected."""
        return not isinstance(self._port, ClosedPort)

    @property
    def has_writer(self) -> bool:
        """Whether the interface has a writer, possibly this instance."""
        return self._port.has_writer()

    @property
    def num_readers(self) -> int:
        """The number of readers, including this instance if it is a reader."""
        return len(self._port.reader_owners())

    @property
    def writer(self) -> str:
        """The owner of the writer, empty without a writer."""
        return self._port.writer_owner()

    @property
    def readers(self) -> tuple[str, ...]:
        """The owners of the readers in the order of opening."""
        return self._port.reader_owners()

    def reader_owner(self, serial: str) -> str:
        """Return the owner of the reader with a serial, empty if the serial is unknown.

        Fawkes' server does not report the serials of its readers.
        """
        return self._port.reader_owner(serial)

    @property
    def version_read(self) -> int:
        """The number of writes of the shared block at the last :meth:`read` or :meth:`write`; 0 before."""
        return self._read_version

    def read(self) -> bool:
        """Update the private copy from the shared block.

        Values that were set but not written are lost. The call is cheap if nothing was written since the last
        call.

        :returns: whether the block has got a new time stamp since the last :meth:`read` or :meth:`write`; on
            a reader the value of :attr:`refreshed`.
        :raises InvalidInstanceError: if the instance is closed.
        """
        port = self._port
        if port.version == self._version and not self._refreshed:
            self._read_refreshed = self._read_changed = False
            return False
        replaced_copy = bytes(self._buf) if self._version == _COPY_REPLACED else None
        version, last_stamped, last_changed = port.fetch(self._buf)
        self._read_refreshed = last_stamped > self._read_version
        self._read_changed = last_changed > self._read_version
        if replaced_copy is not None:
            self._compare_with_replaced(replaced_copy)
        self._version = self._read_version = version
        # as in Fawkes, the flags of a writer last until its next write
        if not self.is_writer:
            self._refreshed = self._changed = False
        return self._read_refreshed

    def write(self) -> None:
        """Publish the private copy.

        On a local blackboard, listeners are called in this thread before the method returns.

        If a setter was called since the last write, the block gets a new time stamp: that of the clock, or
        the explicit time stamp while :attr:`auto_timestamping` is off. Otherwise the time stamp stays.

        :raises WriteDeniedError: on a reader.
        :raises InvalidInstanceError: if the instance is closed.
        """
        if not self.is_writer:
            raise WriteDeniedError(self.type, self.id, "Cannot write.")
        changed = self._changed
        stamped: bool | None = self._refreshed
        self._refreshed = self._changed = False
        if stamped:
            now_us = self._port.now_us() if self._explicit_stamp_us is None else self._explicit_stamp_us
            STAMP.pack_into(self._buf, 0, now_us // MICROSECONDS, now_us % MICROSECONDS)
        # the copy was never read, or was replaced without setters: only a comparison shows whether its time
        # stamp is new
        elif self._version < 0:
            stamped = None
        self._version = self._read_version = self._port.publish(self, self._buf, stamped, changed)

    def publish_block(self, block: bytes, stamped: bool | None, changed: bool) -> None:
        """Publish a block that was written in another process; for transports.

        :param block: the block, of the interface's size.
        :param stamped: whether the time stamp is new; None if only a comparison of the blocks can tell.
        :param changed: whether a value changed since the previous write.
        """
        # each update of each client passes here: the port keeps these bytes, which saves a copy
        self._buf[:] = block
        self._version = _COPY_REPLACED
        self._port.publish(self, block, stamped, changed)

    @property
    def refreshed(self) -> bool:
        """Whether there is a new block.

        On a reader: the writer wrote a block with a new time stamp between the last two calls of
        :meth:`read`, even if the values are equal. On a writer: a setter was called since the last write.
        """
        return self._refreshed if self.is_writer else self._read_refreshed

    @property
    def changed(self) -> bool:
        """Whether a value differs; stricter than :attr:`refreshed`.

        On a reader: the writer wrote changed data between the last two calls of :meth:`read`; never true in
        Fawkes. On a writer: a setter changed a value since the last write.
        """
        return self._changed if self.is_writer else self._read_changed

    def mark_data_refreshed(self) -> None:
        """Give the next write a new time stamp even without a setter call."""
        self._refreshed = True

    def mark_data_changed(self) -> None:
        """Make the next write a change even without a changed value; for transports."""
        self._changed = True

    def set_from_chunk(self, chunk: bytes | bytearray | memoryview | Sequence[int]) -> None:
        """Replace the private copy including the time stamp, without setting a flag."""
        super().set_from_chunk(chunk)
        self._version = _COPY_REPLACED

    def _compare_with_replaced(self, replaced_copy: bytes) -> None:
        """Set the flags of a read by comparing the new private copy with the replaced copy."""
        stamp_size = STAMP.size
        self._read_refreshed |= replaced_copy[:stamp_size] != self._buf[:stamp_size]
        self._read_changed |= replaced_copy[stamp_size:] != self._buf[stamp_size:]

    @property
    def auto_timestamping(self) -> bool:
        """Whether writes carry the time of the clock; True by default."""
        return self._explicit_stamp_us is None

    @auto_timestamping.setter
    def auto_timestamping(self, is_enabled: bool) -> None:
        self._explicit_stamp_us = None if is_enabled else self.timestamp_us

    @property
    def timestamp_us(self) -> int:
        """The time stamp of the private copy, in microseconds since the epoch."""
        return super().timestamp_us

    @timestamp_us.setter
    def timestamp_us(self, time_us: int) -> None:
        self.set_timestamp(time_us)

    def set_timestamp(self, time_us: int | None = None) -> None:
        """Set the time stamp of the next write, which then counts as refreshed and changed.

        :param time_us: the time in microseconds since the epoch, by default the time of the clock.
        :raises TimestampError: on a reader, or while :attr:`auto_timestamping` is on.
        """
        if self._explicit_stamp_us is None:
            raise TimestampError("Auto timestamping enabled, cannot set explicit timestamp")
        if not self.is_writer:
            raise TimestampError("Timestamp can only be set on writing instance")
        self._explicit_stamp_us = self._port.now_us() if time_us is None else time_us
        self._refreshed = self._changed = True
