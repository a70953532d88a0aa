"""The queue of frames for one client: bounded, and never blocks a sender."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from cxbridge.blackboard.fawkesnet.messages.blackboard import data_frame, data_frame_size

CONFLATE_FROM: Final = 4 * 1024 * 1024
"""Bytes waiting from which on new data replace older data of the same instance."""
MOST: Final = 16 * 1024 * 1024
"""Bytes waiting that are too many."""

_BATCH: Final = 64 * 1024


@dataclass(slots=True)
class _Newest:
    """Data of one instance that wait; newer ones take their place.

    :param changed: some value changed since the last update to the client.
    :param refreshed: CHANGED of its newest data may still come.
    """

    serial: bytes
    block: bytes
    changed: bool
    refreshed: bool

    def to_bytes(self) -> bytes:
        """Return REFRESHED and, when a value changed, CHANGED."""
        frame = data_frame(self.serial, self.block, changed=False)
        return frame + data_frame(self.serial, self.block, changed=True) if self.changed else frame


class Outbox:
    """Frames in order. Not thread-safe: its session guards it."""

    def __init__(self) -> None:
        self._waiting: deque[bytes | _Newest] = deque()
        self._newest: dict[bytes, _Newest] = {}
        self._ahead: set[bytes] = set()  # their CHANGED was sent for older data already
        self.size = 0
        """Bytes that wait, at most."""

    def __bool__(self) -> bool:
        return bool(self._waiting)

    @property
    def overfull(self) -> bool:
        """Whether more waits than may."""
        return self.size > MOST

    def put(self, frames: bytes) -> None:
        """Add whole frames."""
        self._waiting.append(frames)
        self.size += len(frames)

    def put_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Add the data of an instance, or replace those that wait when there is much to send.

        CHANGED follows the REFRESHED of the same write: where that was not replaced, CHANGED is not, either.
        """
        if serial in self._ahead:
            self._ahead.discard(serial)
            if changed:
                return
        if serial not in self._newest and (changed or self.size < CONFLATE_FROM):
            frame = data_frame(serial, block, changed=changed)
            self._waiting.append(frame)
            self.size += len(frame)
        elif (newest := self._newest.get(serial)) is not None:
            newest.block = block
            newest.changed |= changed
            newest.refreshed = not changed
        else:
            self._newest[serial] = newest = _Newest(serial, block, changed, refreshed=not changed)
            self._waiting.append(newest)
            self.size += 2 * data_frame_size(len(block))

    def take(self) -> bytes:
        """Take the next bytes to send, some whole frames; empty when nothing waits."""
        if self.size < _BATCH and not self._newest:
            frames = b"".join(frame for frame in self._waiting if isinstance(frame, bytes))
            self._waiting.clear()
            self.size = 0
            return frames
        batch: list[bytes] = []
        size = 0
        while self._waiting and size < _BATCH:
            item = self._waiting.popleft()
            if isinstance(item, _Newest):
                del self._newest[item.serial]
                if item.changed and item.refreshed:
                    self._ahead.add(item.serial)
                self.size -= 2 * data_frame_size(len(item.block))
                item = item.to_bytes()
            else:
                self.size -= len(item)
            batch.append(item)
            size += len(item)
        return batch[0] if len(batch) == 1 else b"".join(batch)

    def put_back(self, rest: bytes) -> None:
        """Put back what could not be sent; it is the next to be taken."""
        self._waiting.appendleft(rest)
        self.size += len(rest)
