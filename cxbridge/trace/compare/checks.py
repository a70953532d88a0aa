"""Checks of the message ids and times of paired events.

Two events are paired if their contents are equal. The message ids and times of any two runs differ, so
the checks compare the offsets between both runs with the offsets of earlier pairs.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.compare.keys import Key, thread_key

# The slot `id` of the fact of an interface, which names the interface among those of its type.
_FACT_ID: Final = re.compile(r'\(id "?([^")]*)')


class MessageIdCheck:
    """Compares the message ids of paired events.

    A stream is a Skiller or interface, whose messages are numbered together. The offset of a pair is the
    difference of its two ids. The ids count as equal if the offset is that of an earlier pair of the stream.
    """

    def __init__(self) -> None:
        self._offsets: dict[Hashable, tuple[int, int]] = {}  # the previous and the last offset by stream

    def has_new_offset(self, stream: Hashable, id_a: int, id_b: int) -> bool:
        """Return whether a pair's offset is new. The id 0 means no message and equals only 0."""
        if not id_a or not id_b:
            return bool(id_a or id_b)
        offset = id_b - id_a
        # after a single wrong id, the next pair may keep the new offset or return to the previous offset
        offsets = self._offsets.setdefault(stream, (offset, offset))
        if offset in offsets:
            return False
        self._offsets[stream] = (offsets[1], offset)
        return True

    def forget_offset(self, stream: Hashable) -> None:
        """Accept any next offset of a stream, because only one run has an event of the stream."""
        self._offsets.pop(stream, None)


class TimeCheck:
    """Compares the times between the paired events of each goal, plan, Skiller or interface.

    :param tolerance_s: the allowed difference between the times of paired events in seconds.
    """

    def __init__(self, tolerance_s: float) -> None:
        self._limit_us = round(tolerance_s * MICROSECONDS)
        self._last_times: dict[Hashable, tuple[int, int]] = {}  # of both runs, in microseconds

    def measure_exceeding_lag_s(self, thread: Hashable, a_us: int, b_us: int) -> float | None:
        """Return the lag of the second run, negative if it is early; None within the tolerance.

        :param thread: the goal, plan, Skiller or interface of the pair.
        """
        # the first event of a thread has no earlier time, so its lag is 0
        last_a_us, last_b_us = self._last_times.get(thread, (a_us, b_us))
        self._last_times[thread] = (a_us, b_us)
        lag_us = (b_us - last_b_us) - (a_us - last_a_us)
        return None if abs(lag_us) <= self._limit_us else lag_us / MICROSECONDS


def message_stream(key: Key) -> Hashable:
    """Return the stream of an event: the Skiller or interface that numbers its messages together."""
    if key[0] != "fact":
        return thread_key(key)
    _kind, env, template, _direction, text = key
    match = _FACT_ID.search(text)
    return (env, template, match.group(1) if match else "")


def describe_lag(lag_s: float) -> str:
    """Return the text for an event of B that is late, or early if the lag is negative."""
    return f"another time: {abs(lag_s):.6g} s {'later' if lag_s > 0 else 'earlier'} in B"
