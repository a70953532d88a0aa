"""Conversion of a byte stream to frames and back, without I/O.

A frame is a header and a payload. Source: docs/evidence/protocol-fawkes.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from cxbridge_fawkes.network.errors import FrameTooLongError

HEADER: Final = Struct(">HHI")
"""The component, the kind of message, and the size of the payload."""


class ComponentId(IntEnum):
    """The components of Fawkes' network protocol."""

    PLUGIN_MANAGER = 1
    BLACKBOARD = 2
    CONFIGURATION = 3
    NETWORK_LOGGER = 4


class FawkesFrame(NamedTuple):
    """A message on the wire.

    :param component: a :class:`ComponentId`, or an unknown number.
    :param kind: the number of the message within its component.
    :param payload: the content.
    """

    component: int
    kind: int
    payload: bytes = b""

    def to_bytes(self) -> bytes:
        return HEADER.pack(self.component, self.kind, len(self.payload)) + self.payload


FindPayloadLimit = Callable[[int, int], int]
"""A function that returns the present maximum size of a payload, by the component and the kind of message."""


class FrameDecoder:
    """Splits a byte stream into frames.

    The decoder buffers at most one incomplete frame, and none above the limit.

    :param find_limit: returns the limit of a payload.
    """

    def __init__(self, find_limit: FindPayloadLimit) -> None:
        self._find_limit: Final = find_limit
        self._pending = bytearray()
        self._needed_size = HEADER.size

    @property
    def pending_size(self) -> int:
        """The number of buffered bytes."""
        return len(self._pending)

    def feed(self, received_bytes: bytes) -> Iterator[FawkesFrame]:
        """Yield the completed frames. The iterator must be exhausted before the next call.

        A frame may change the limits for later frames.

        :raises FrameTooLongError: if the size in a header exceeds the limit. The rest of the stream cannot be
            decoded.
        """
        # usually, the received bytes are whole frames, which need no copy to the buffer
        if self._pending:
            self._pending += received_bytes
            if len(self._pending) < self._needed_size:
                return  # a large frame comes in many pieces; a conversion for each would take quadratic time
            received_bytes = bytes(self._pending)
            self._pending.clear()
        start, end = 0, len(received_bytes)
        while end - start >= HEADER.size:
            component, kind, size = HEADER.unpack_from(received_bytes, start)
            # before the payload is buffered, because the limit bounds the memory for a peer
            if size > (limit := self._find_limit(component, kind)):
                raise FrameTooLongError(component, kind, size, limit)
            frame_end = start + HEADER.size + size
            if frame_end > end:
                self._needed_size = frame_end - start
                self._pending += received_bytes[start:]
                return
            yield FawkesFrame(component, kind, received_bytes[start + HEADER.size : frame_end])
            start = frame_end
        self._needed_size = HEADER.size
        self._pending += received_bytes[start:]
