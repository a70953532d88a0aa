"""Times in messages: ``builtin_interfaces/msg/Time``, seconds and nanoseconds since the epoch."""

from __future__ import annotations

from typing import Final

from cxbridge.clock import MICROSECONDS, split_us
from cxbridge_ros2.messages import Message

NANOSECONDS: Final = 1000  # per microsecond

_LATEST_US: Final = 2**31 * MICROSECONDS - 1  # the seconds of a stamp are int32


def stamp_of(time_us: int) -> Message:
    """Return a time in microseconds as a stamp, limited to the range of stamps."""
    seconds, microseconds = split_us(max(0, min(time_us, _LATEST_US)))
    return {"sec": seconds, "nanosec": microseconds * NANOSECONDS}


def microseconds_of(stamp: Message) -> int:
    return int(stamp["sec"]) * MICROSECONDS + int(stamp["nanosec"]) // NANOSECONDS


def nanoseconds_of(stamp: Message) -> int:
    return int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
