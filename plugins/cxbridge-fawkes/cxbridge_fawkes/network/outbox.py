"""A bounded queue of frames for one client, which never blocks a sender.

A client that reads slowly gets fewer updates, not later ones: data that are added while many bytes are queued
are replaced by newer data of the same instance (conflation). Other frames stay in order and are never
dropped.

Fawkes announces a write by a frame REFRESHED with the data, followed by a frame CHANGED with the same data if
a value has changed.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from cxbridge_fawkes.network.messages.blackboard import data_frame_size, pack_data_frame

# about 1,700 changes of a SkillerInterface, so that a client that only pauses misses no change
CONFLATE_FROM: Final = 4 * 1024 * 1024
"""The number of queued bytes from which added data are replaceable by newer data of the same instance."""
# at least the largest frame, a list of interfaces, see messages.codec.CLIENT_MESSAGE_LIMIT
MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""The maximum number of queued bytes."""

_BATCH_BYTES: Final = 64 * 1024  # the size of one call of send, about a socket's buffer


@dataclass(slots=True)
class _ReplaceableData:
    """The queued data of one instance, which newer data replace.

    :param changed: whether a value has changed since the client's last update.
    :param changed_may_follow: whether the last frame was REFRESHED, whose CHANGED may follow.
    """

    serial: bytes
    block: bytes
    changed: bool
    changed_may_follow: bool

    def to_bytes(self) -> bytes:
        """Return REFRESHED and, after changes, CHANGED."""
        frame = pack_data_frame(self.serial, self.block, changed=False)
        return frame + pack_data_frame(self.serial, self.block, changed=True) if self.changed else frame


class Outbox:
    """Frames in order. Not thread-safe: the session's lock guards it."""

    def __init__(self) -> None:
        self._queue: deque[bytes | _ReplaceableData] = deque()
        self._replaceable_by_serial: dict[bytes, _ReplaceableData] = {}
        self._changed_sent: set[bytes] = set()  # instances whose pending CHANGED was sent with older data
        self.queued_bytes = 0
        """An upper bound of the number of queued bytes: replaceable data count as REFRESHED and CHANGED."""

    def __bool__(self) -> bool:
        return bool(self._queue)

    def put_frames(self, frames: bytes) -> None:
        """Add complete frames."""
        self._queue.append(frames)
        self.queued_bytes += len(frames)

    def put_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Add the data of an instance, or replace its queued data if these are replaceable.

        :param changed: whether the frame is CHANGED instead of REFRESHED.
        """
        if serial in self._changed_sent:
            self._changed_sent.discard(serial)
            if changed:
                return
        # CHANGED must follow the REFRESHED of its write; if REFRESHED was added as a frame, so is CHANGED,
        # even above the limit
        if serial not in self._replaceable_by_serial and (changed or self.queued_bytes < CONFLATE_FROM):
            frame = pack_data_frame(serial, block, changed=changed)
            self._queue.append(frame)
            self.queued_bytes += len(frame)
        elif (replaceable := self._replaceable_by_serial.get(serial)) is not None:
            replaceable.block = block
            replaceable.changed |= changed
            replaceable.changed_may_follow = not changed
        else:
            self._replaceable_by_serial[serial] = replaceable = _ReplaceableData(
                serial, block, changed, changed_may_follow=not changed
            )
            self._queue.append(replaceable)
            self.queued_bytes += 2 * data_frame_size(len(block))

    def take_frames(self) -> bytes:
        """Remove and return the next frames; empty if the queue is empty.

        The first bytes may be the end of a frame, from :meth:`put_back`.
        """
        batch: list[bytes] = []
        size = 0
        while self._queue and size < _BATCH_BYTES:
            item = self._queue.popleft()
            if isinstance(item, _ReplaceableData):
                del self._replaceable_by_serial[item.serial]
                if item.changed and item.changed_may_follow:
                    self._changed_sent.add(item.serial)
                self.queued_bytes -= 2 * data_frame_size(len(item.block))
                item = item.to_bytes()
            else:
                self.queued_bytes -= len(item)
            batch.append(item)
            size += len(item)
        return batch[0] if len(batch) == 1 else b"".join(batch)

    def put_back(self, unsent: bytes) -> None:
        """Return the unsent end of :meth:`take_frames` to the front of the queue."""
        self._queue.appendleft(unsent)
        self.queued_bytes += len(unsent)
