"""Checks message ids and times of events that are partners."""

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
    """The events that times are counted from."""

    BEGIN = "begin"
    THREAD = "thread"


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far the times of partners may be apart.

    :param seconds: the tolerance.
    """

    seconds: float
    since: TimeFrom = TimeFrom.THREAD


class MessageIds:
    """Ids of messages count as the distance to earlier ones of their stream, whatever came before the run."""

    def __init__(self) -> None:
        self._offsets: dict[Hashable, tuple[int, int]] = {}

    def differ(self, stream: Hashable, one: int, other: int) -> bool:
        """Whether two ids do not continue like those before them; 0, no message yet, stays apart."""
        if not one or not other:
            return bool(one or other)
        offset = other - one
        known = self._offsets.setdefault(stream, (offset, offset))
        if offset in known:
            return False
        self._offsets[stream] = (known[1], offset)
        return True

    def gap(self, stream: Hashable) -> None:
        """Note that only one run has an event of the stream: the ids of the two may differ then."""
        self._offsets.pop(stream, None)


class PartnerTimes:
    """Times of partners, relative to earlier times.

    :param begin: when both runs began, microseconds; None: with the first partners that are asked for.
    """

    def __init__(self, tolerance: Tolerance, begin: tuple[int, int] | None = None) -> None:
        self._limit_us = round(tolerance.seconds * MICROSECONDS)
        self._by_thread = tolerance.since is TimeFrom.THREAD
        self._last: dict[Hashable, tuple[int, int]] = {}
        self._begin = begin

    def lag(self, thread: Hashable, one_us: int, other_us: int) -> float | None:
        """Return by how many seconds the second run is late (early: less than 0), None within the limit."""
        now = (one_us, other_us)
        if self._by_thread:
            since = self._last.get(thread, now)
            self._last[thread] = now
        else:
            since = self._begin = self._begin or now
        lag_us = (other_us - since[1]) - (one_us - since[0])
        return None if abs(lag_us) <= self._limit_us else lag_us / MICROSECONDS


def stream_of(key: Key) -> Hashable:
    """Return the counter of the message ids in events of this key: a skiller, an interface."""
    if key[0] != "fact":
        return thread_key(key)
    match = _ID.search(key[-1])
    return (key[1], key[2], match.group(1) if match else "")


def time_words(late: float) -> str:
    """Return in words that an event of B is late, or early (less than 0), by a number of seconds."""
    return f"another time: {abs(late):.6g} s {'later' if late > 0 else 'earlier'} in B"
