"""Private buffers of a data block, which keep earlier contents of it."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance_errors import BufferIndexError
from cxbridge.interfaces.message import STAMP


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
