"""When the executive thinks: a separate timer, at ``refresh-rate``.

The original runs the rules in the callback of a wall timer. When a callback takes longer than the period, the
next one comes at once, before the executive's process does anything else.
"""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS, Clock


class RefreshTimer:
    """A timer with a period.

    :param clock: the run's clock.
    :param period_us: microseconds between two runs of the rules.
    """

    def __init__(self, clock: Clock, period_us: int) -> None:
        self._clock = clock
        self._period_us = period_us
        self._next_us = clock.now_us() + period_us
        self._late = False

    def start(self) -> None:
        """Begin: the first time is a period from now."""
        self._next_us = self._clock.now_us() + self._period_us

    def due(self) -> bool:
        """Return whether the rules are to run now; then the next time is a period later."""
        if self._late:
            self._late = False
            return True
        now_us = self._clock.now_us()
        if now_us < self._next_us:
            return False
        # a late run does not make later ones late; missed runs are dropped
        missed = (now_us - self._next_us) // self._period_us
        self._next_us += (missed + 1) * self._period_us
        return True

    def block(self, seconds: float) -> None:
        """Note that something blocks the callback that runs now: past the next time, that one comes at once.

        On a virtual clock no time passes within a callback, so the order of things is all that changes.
        """
        if seconds * MICROSECONDS >= self._period_us:
            self._late = True


def nanoseconds_too(now_us: int) -> tuple[float, int]:
    """Return the time as the original's ``(now)``: seconds with their fraction, and nanoseconds of the epoch.

    Its ``time-diff-sec`` takes the second number for microseconds, so time-outs pass 1,000 times too soon.
    """
    return now_us / MICROSECONDS, now_us * 1000
