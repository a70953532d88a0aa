"""Conversion of a byte stream to frames and back, without I/O.

Source: docs/evidence/protocol-fawkes.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from cxbridge.blackboard.fawkesnet.errors import FrameTooLongError

HEADER: Final = Struct(">HHI")
"""Component, kind, size of payload."""


class ComponentId(IntEnum):
    """The components of Fawkes' network protocol."""

    PLUGIN_MANAGER = 1
    BLACKBOARD = 2
    CONFIGURATION = 3
    NETWORK_LOGGER = 4


class FawkesFrame(NamedTuple):
    """One message on the wire.

    :param component: a :class:`ComponentId`, or an unknown number.
    :param kind: the number of the message within its component.
    :param payload: the content.
    """

    component: int
    kind: int
    payload: bytes = b""

    def to_bytes(self) -> bytes:
        return HEADER.pack(self.component, self.kind, len(self.payload)) + self.payload


Limit = Callable[[int, int], int]
"""Returns the present maximum payload for a component and kind."""


class FrameDecoder:
    """Splits a byte stream into frames.

    It buffers at most one incomplete frame, and none above the limit.

    :param limit: returns the limit for a header that announces more than ``always``.
    :param always: the size permitted without calling ``limit``; -1 calls it for every frame.
    """

    def __init__(self, limit: Limit, always: int = -1) -> None:
        self._limit: Final = limit
        self._always: Final = always
        self._pending = bytearray()
        self._needed = HEADER.size

    @property
    def pending(self) -> int:
        """The number of buffered bytes."""
        return len(self._pending)

    def feed(self, data: bytes) -> Iterator[FawkesFrame]:
        """Yield the completed frames. The iterator must be exhausted before the next call.

        A frame may change the limits for later ones.

        :raises FrameTooLongError: if a header exceeds the limit. The rest of the stream cannot be decoded.
        """
        # the usual piece has whole frames, which are not copied
        if self._pending:
            self._pending += data
            if len(self._pending) < self._needed:
                return  # a large frame comes in many pieces, and is split only once
            data = bytes(self._pending)
            self._pending.clear()
        start, end = 0, len(data)
        while end - start >= HEADER.size:
            component, kind, size = HEADER.unpack_from(data, start)
            # before the payload is collected: the limit bounds the memory that a client costs
            if size > self._always and size > (allowed := self._limit(component, kind)):
                raise FrameTooLongError(component, kind, size, allowed)
            frame_end = start + HEADER.size + size
            if frame_end > end:
                self._needed = frame_end - start
                self._pending += data[start:]
                return
            yield FawkesFrame(component, kind, data[start + HEADER.size : frame_end])
            start = frame_end
        self._needed = HEADER.size
        self._pending += data[start:]
