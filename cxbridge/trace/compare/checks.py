"""Checks of the message ids and times of paired events."""

from __future__ import annotations

import re
from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.compare.keys import Key, thread_key

_ID: Final = re.compile(r'\(id "?([^")]*)')


class TimeFrom(Enum):
    """The reference of compared times."""

    BEGIN = "begin"
    THREAD = "thread"


@dataclass(frozen=True, slots=True)
class Tolerance:
    """The allowed difference between the times of paired events."""

    seconds: float
    since: TimeFrom = TimeFrom.THREAD


class MessageIds:
    """Compares message ids by their distance to earlier ids of their stream."""

    def __init__(self) -> None:
        self._offsets: dict[Hashable, tuple[int, int]] = {}

    def differ(self, stream: Hashable, id_a: int, id_b: int) -> bool:
        """Return whether the distance of two ids changed; 0 means no message and equals only 0."""
        if not id_a or not id_b:
            return bool(id_a or id_b)
        offset = id_b - id_a
        # one wrong id is one difference: the next ids may have its offset, or the offset before it
        offsets = self._offsets.setdefault(stream, (offset, offset))
        if offset in offsets:
            return False
        self._offsets[stream] = (offsets[1], offset)
        return True

    def gap(self, stream: Hashable) -> None:
        """Note an event of a stream that only one run has, after which the distance may change."""
        self._offsets.pop(stream, None)


class PartnerTimes:
    """Compares times of paired events relative to earlier times.

    :param begin: the start of both runs in microseconds; None: the first pair.
    """

    def __init__(self, tolerance: Tolerance, begin: tuple[int, int] | None = None) -> None:
        self._limit_us = round(tolerance.seconds * MICROSECONDS)
        self._by_thread = tolerance.since is TimeFrom.THREAD
        self._last: dict[Hashable, tuple[int, int]] = {}
        self._begin = begin

    def lag(self, thread: Hashable, a_us: int, b_us: int) -> float | None:
        """Return the seconds by which the second run is late (negative: early); None within the tolerance."""
        times = (a_us, b_us)
        if self._by_thread:
            # the first event of a thread has no earlier time, so its lag is 0
            reference = self._last.get(thread, times)
            self._last[thread] = times
        else:
            reference = self._begin = self._begin or times
        lag_us = (b_us - reference[1]) - (a_us - reference[0])
        return None if abs(lag_us) <= self._limit_us else lag_us / MICROSECONDS


def stream_of(key: Key) -> Hashable:
    """Return the stream that numbers the message ids of a key: a Skiller or an interface."""
    if key[0] != "fact":
        return thread_key(key)
    match = _ID.search(key[-1])
    return (key[1], key[2], match.group(1) if match else "")


def lag_text(lag: float) -> str:
    """Return the text for an event of B that is late, or early if negative, by some seconds."""
    return f"another time: {abs(lag):.6g} s {'later' if lag > 0 else 'earlier'} in B"
