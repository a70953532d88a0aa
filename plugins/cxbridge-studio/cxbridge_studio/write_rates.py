"""Measures the rates of writes to interfaces."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, pstdev
from typing import Final

OWNER: Final = "cxbridge bb"  # the name under which the commands read interfaces

WINDOW: Final = 10_000  # latest writes over which a rate is computed, as in `ros2 topic hz`


@dataclass(frozen=True, slots=True)
class Rate:
    """The rate of writes. The field names are keys in the JSON output of ``cxbridge bb hz``.

    :param hz: the mean rate.
    :param shortest_s: the shortest interval between two writes.
    :param longest_s: the longest interval between two writes.
    :param deviation_s: the standard deviation of the intervals.
    :param window: the number of the latest writes from which the rate was computed.
    """

    hz: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class RateMeter:
    """Measures the rate of writes.

    :param window: the number of latest writes to consider.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self._times: deque[float] = deque(maxlen=max(2, window))  # two writes have an interval
        self._new_write_count = 0

    def add(self, time_s: float) -> None:
        """Record a write."""
        self._times.append(time_s)
        self._new_write_count += 1

    def count_new_writes(self) -> int:
        """Return the number of writes since the last call of this method."""
        count, self._new_write_count = self._new_write_count, 0
        return count

    def rate(self) -> Rate | None:
        """Return the rate; None before the second write. The rate of simultaneous writes is infinite."""
        intervals_s = [later_s - earlier_s for earlier_s, later_s in pairwise(self._times)]
        if not intervals_s:
            return None
        mean_s = fmean(intervals_s)
        hz = 1 / mean_s if mean_s > 0 else float("inf")
        return Rate(hz, min(intervals_s), max(intervals_s), pstdev(intervals_s, mean_s), len(self._times))
