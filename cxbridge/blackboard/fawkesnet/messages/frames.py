"""Frames of Fawkes' network protocol: bytes of a stream to frames and back; no I/O.

Source: docs/evidence/protocol-fawkes.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from cxbridge.blackboard.fawkesnet.errors import FrameTooLongError

HEADER: Final = Struct(">HHI")
"""Component, kind, bytes of payload."""


class ComponentId(IntEnum):
    """Who a frame is for."""

    PLUGIN_MANAGER = 1
    BLACKBOARD = 2
    CONFIGURATION = 3
    NETWORK_LOGGER = 4


class FawkesFrame(NamedTuple):
    """One message on the wire.

    :param component: who it is for; a :class:`ComponentId` or the number of one that is not known here.
    :param kind: number of the message, each component has its own.
    :param payload: the message itself.
    """

    component: int
    kind: int
    payload: bytes = b""

    def to_bytes(self) -> bytes:
        """Return header and payload."""
        return HEADER.pack(self.component, self.kind, len(self.payload)) + self.payload


Limit = Callable[[int, int], int]
"""Takes component and kind, returns how many bytes of payload such a message may have now."""


class FrameDecoder:
    """Cuts a stream of bytes into frames, however it is dealt out.

    It keeps no more than one incomplete frame, and none that is longer than allowed.

    :param limit: asked at each header that announces more than ``always``.
    :param always: bytes of payload that any message may have; -1: not even none is allowed without asking.
    """

    def __init__(self, limit: Limit, always: int = -1) -> None:
        self._limit: Final = limit
        self._always: Final = always
        self._pending = bytearray()
        self._needed = HEADER.size

    @property
    def pending(self) -> int:
        """How many bytes wait for the rest of their frame."""
        return len(self._pending)

    def feed(self, data: bytes) -> Iterator[FawkesFrame]:
        """Yield the frames that ``data`` completes; the iterator must be used up before the next call.

        A yielded frame may change the limits of the next ones.

        :raises FrameTooLongError: at a header that announces too much; the stream cannot be decoded further.
        """
        if self._pending:
            self._pending += data
            if len(self._pending) < self._needed:
                return
            data = bytes(self._pending)
            self._pending.clear()
        start, end = 0, len(data)
        while end - start >= HEADER.size:
            component, kind, size = HEADER.unpack_from(data, start)
            if size > self._always and size > (allowed := self._limit(component, kind)):
                raise FrameTooLongError(component, kind, size, allowed)
            after = start + HEADER.size + size
            if after > end:
                self._needed = after - start
                self._pending += data[start:]
                return
            yield FawkesFrame(component, kind, data[start + HEADER.size : after])
            start = after
        self._needed = HEADER.size
        self._pending += data[start:]
