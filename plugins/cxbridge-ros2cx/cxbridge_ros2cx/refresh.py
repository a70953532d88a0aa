"""The timer of the executive's rules, with the rate ``refresh-rate``.

The original, ros2-clips-executive (2021), runs the rules in the callback of a wall timer. When a callback
takes longer than the period, the next callback follows at once, before any other work of the process.
"""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS, Clock


class RefreshTimer:
    """A periodic timer.

    :param period_us: the time between two runs of the rules.
    """

    def __init__(self, clock: Clock, period_us: int) -> None:
        self._clock = clock
        self._period_us = period_us
        self._next_us = clock.now_us() + period_us
        self._is_late = False

    def start(self) -> None:
        """Start the timer; the first run is due after one period."""
        self._next_us = self._clock.now_us() + self._period_us

    def due(self) -> bool:
        """Return whether a run is due, and schedule the next one."""
        if self._is_late:
            self._is_late = False
            return True
        now_us = self._clock.now_us()
        if now_us < self._next_us:
            return False
        # a late run does not delay later runs; missed runs are dropped
        missed = (now_us - self._next_us) // self._period_us
        self._next_us += (missed + 1) * self._period_us
        return True

    def block(self, seconds: float) -> None:
        """Note that the current callback blocks; if it blocks past the next run, that run follows at once.

        On a virtual clock no time passes within a callback, so only the order of events changes.
        """
        if seconds * MICROSECONDS >= self._period_us:
            self._is_late = True


def seconds_and_nanoseconds(now_us: int) -> tuple[float, int]:
    """Return the time as the original's ``(now)``: seconds with their fraction, and nanoseconds of the epoch.

    The original's ``time-diff-sec`` interprets the second number as microseconds, so timeouts expire 1,000
    times too soon.
    """
    return now_us / MICROSECONDS, now_us * 1000
