"""Times of a run that never go back."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS

STEP_US = MICROSECONDS
"""A step back of more than this is a clock that was set; a smaller one is events that overtook each other."""


class SteadyClock:
    """Turns the times of events, in recorded order, into microseconds since the first, never decreasing.

    When the clock was set back, time continues from its old value. An event that follows slightly later
    ones has their time.

    :param start_us: the run's clock at the start; None: the time of the first event.
    """

    def __init__(self, start_us: int | None = None) -> None:
        self.now_us = 0
        """Time of the last event."""
        self.first_us = start_us
        """The run's clock at the start."""
        self.steps: list[tuple[int, int]] = []
        """Where the clock was set back: time on this clock, and by how many microseconds."""
        self._offset = start_us or 0

    def at(self, time_us: int) -> int:
        """Return when an event was, that follows those asked for before.

        :param time_us: the time on the run's clock.
        """
        if self.first_us is None:
            self.first_us = self._offset = time_us
        since = time_us - self._offset
        if since < self.now_us - STEP_US:
            self.steps.append((self.now_us, self.now_us - since))
            self._offset = time_us - self.now_us
        elif since > self.now_us:
            self.now_us = since
        return self.now_us

    def notes(self) -> list[str]:
        """Return the warnings for the reader of these times."""
        if not self.steps:
            return []
        at_us, back_us = self.steps[0]
        text = (
            f"The clock was set back by {back_us / MICROSECONDS:.3f} s at {at_us / MICROSECONDS:.3f} s; "
            "times go on from there as if it had not been."
        )
        return [text if len(self.steps) == 1 else f"{text} It was set back {len(self.steps)} times."]
