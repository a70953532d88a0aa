"""Conversion of the times of events into times that never decrease, even if the clock is set back."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS

MIN_SETBACK_US = MICROSECONDS
"""A larger step back means that the clock was set back, a smaller step that events overtook each other.

The value is chosen freely.
"""


class MonotonicClock:
    """Converts times of events into non-decreasing microseconds since the start of the run.

    If the clock is set back, time continues from its previous value. An event slightly before its predecessor
    gets the predecessor's time.

    :param start_us: the clock at the start of the run; None: at the first event.
    """

    def __init__(self, start_us: int | None = None) -> None:
        self.now_us = 0
        """The time of the last event, in microseconds since the start of the run."""
        self.start_us = start_us
        """The clock at the start of the run; None before the first event if the start is not known."""
        self.setbacks: list[tuple[int, int]] = []
        """The setbacks of the run's clock: the converted time and the size of each, in microseconds."""
        self._offset_us = start_us or 0

    def advance_to(self, time_us: int) -> int:
        """Return the time of the next event, in microseconds since the start of the run.

        :param time_us: the time of the event on the clock of the run.
        """
        if self.start_us is None:
            self.start_us = self._offset_us = time_us
        elapsed_us = time_us - self._offset_us
        if elapsed_us < self.now_us - MIN_SETBACK_US:
            self.setbacks.append((self.now_us, self.now_us - elapsed_us))
            self._offset_us = time_us - self.now_us
        elif elapsed_us > self.now_us:
            self.now_us = elapsed_us
        return self.now_us

    def describe_setbacks(self) -> list[str]:
        """Return a list of one warning for the user; empty if the clock was never set back."""
        if not self.setbacks:
            return []
        at_us, setback_us = self.setbacks[0]
        text = (
            f"The clock was set back by {setback_us / MICROSECONDS:.3f} s at {at_us / MICROSECONDS:.3f} s; "
            "times continue as if it had not been."
        )
        return [text if len(self.setbacks) == 1 else f"{text} It was set back {len(self.setbacks)} times."]
