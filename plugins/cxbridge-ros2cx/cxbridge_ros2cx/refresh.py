"""A periodic timer like those of ROS, e.g. for the runs of the rules, heartbeats and lookups.

The thesis' executive, ros2-clips-executive (2021), runs the rules in the callback of a ROS wall timer. When a
callback takes a period or longer, the next callback follows at once, before any other work of the process.
"""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS, Clock


class RefreshTimer:
    """A periodic timer.

    :param period_us: the time between two due times.
    """

    def __init__(self, clock: Clock, period_us: int) -> None:
        self._clock = clock
        self._period_us = period_us
        self._next_us = clock.now_us() + period_us
        self._is_late = False

    def advance_if_due(self) -> bool:
        """Return whether the timer is due; if its due time has passed, schedule the next one."""
        if self._is_late:
            self._is_late = False
            return True
        now_us = self._clock.now_us()
        if now_us < self._next_us:
            return False
        # as with a ROS timer, a late check does not delay later due times, and missed due times are dropped
        missed_count = (now_us - self._next_us) // self._period_us
        self._next_us += (missed_count + 1) * self._period_us
        return True

    def record_blocking(self, seconds: float) -> None:
        """Record that the current callback blocks.

        If the callback blocks for a period or longer, the timer is due again at once. On a virtual clock no
        time passes within a callback, so only the order of events changes.
        """
        if seconds * MICROSECONDS >= self._period_us:
            self._is_late = True


def to_seconds_and_nanoseconds(now_us: int) -> tuple[float, int]:
    """Return the values of ``(now)`` in the thesis' executive: seconds with their fraction, and nanoseconds.

    Both count from the epoch. The executive's ``time-diff-sec`` interprets the second number as microseconds,
    so timeouts expire about 1,000 times too soon.
    """
    return now_us / MICROSECONDS, now_us * 1000
