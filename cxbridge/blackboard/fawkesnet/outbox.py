"""A bounded queue of frames for one client, which never blocks a sender.

A client that reads slowly gets fewer updates, not later ones: above a limit, new data of an instance replace
its queued data. Other frames stay in order and are never dropped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from cxbridge.blackboard.fawkesnet.messages.blackboard import data_frame, data_frame_size

# about 3,000 updates of a SkillerInterface: a client that only pauses misses none
CONFLATE_FROM: Final = 4 * 1024 * 1024
"""The number of queued bytes from which new data replace older data of the same instance."""
# a list of interfaces has at most as many bytes, see messages.codec.LIST_LIMIT
MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""The maximum number of queued bytes."""

_BATCH: Final = 64 * 1024  # bytes of frames that are sent together


@dataclass(slots=True)
class _Newest:
    """The queued data of one instance, replaceable by newer data.

    :param changed: whether a value has changed since the client's last update.
    :param refreshed: whether CHANGED for the newest data may follow.
    """

    serial: bytes
    block: bytes
    changed: bool
    refreshed: bool

    def to_bytes(self) -> bytes:
        """Return REFRESHED and, after changes, CHANGED."""
        frame = data_frame(self.serial, self.block, changed=False)
        return frame + data_frame(self.serial, self.block, changed=True) if self.changed else frame


class Outbox:
    """Frames in order. Not thread-safe, because its session guards it."""

    def __init__(self) -> None:
        self._waiting: deque[bytes | _Newest] = deque()
        self._newest: dict[bytes, _Newest] = {}
        self._ahead: set[bytes] = set()  # instances whose CHANGED was sent with older data
        self.size = 0
        """An upper bound of the queued bytes, which counts replaceable data as changed."""

    def __bool__(self) -> bool:
        return bool(self._waiting)

    @property
    def overfull(self) -> bool:
        """Whether more than :data:`MAX_QUEUED_BYTES` are queued."""
        return self.size > MAX_QUEUED_BYTES

    def put(self, frames: bytes) -> None:
        """Add complete frames."""
        self._waiting.append(frames)
        self.size += len(frames)

    def put_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Add the data of an instance; with many queued bytes, replace its older data."""
        if serial in self._ahead:
            self._ahead.discard(serial)
            if changed:
                return
        # CHANGED must follow the REFRESHED of the same write, so it is added even above the limit if that
        # REFRESHED was
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
        """Remove and return the next complete frames; empty if the queue is empty."""
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

    def put_back(self, unsent: bytes) -> None:
        """Return the unsent end of :meth:`take` to the front of the queue."""
        self._waiting.appendleft(unsent)
        self.size += len(unsent)
