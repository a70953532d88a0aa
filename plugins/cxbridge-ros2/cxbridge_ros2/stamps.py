"""Conversion of times to stamps and back.

A stamp is a ``builtin_interfaces/msg/Time``: seconds and nanoseconds since the epoch. cxbridge has times in
integer microseconds (``us``); actions compare nanoseconds (``ns``).
"""

from __future__ import annotations

from typing import Final

from cxbridge.clock import MICROSECONDS, split_us
from cxbridge_ros2.messages import Message

NS_PER_US: Final = 1000

_MAX_STAMP_US: Final = 2**31 * MICROSECONDS - 1  # the seconds of a stamp are int32


def us_to_stamp(time_us: int) -> Message:
    """Return a time as a stamp: the epoch for an earlier time, the last stamp for a time beyond the range."""
    seconds, microseconds = split_us(max(0, min(time_us, _MAX_STAMP_US)))
    return {"sec": seconds, "nanosec": microseconds * NS_PER_US}


def stamp_to_us(stamp: Message) -> int:
    """Return a stamp in microseconds, rounded down."""
    return int(stamp["sec"]) * MICROSECONDS + int(stamp["nanosec"]) // NS_PER_US


def stamp_to_ns(stamp: Message) -> int:
    return int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
