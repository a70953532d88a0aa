"""How long each executor of skills was busy in a run."""

from __future__ import annotations

from collections import defaultdict

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, InterfaceMessage, SkillStatus
from cxbridge.history.builder import RunHistory


class BusyTimes:
    """Adds up the executions of Skillers and of a skill board's executors; a sink of events.

    :param start_us: when the run begins.
    """

    events = (SkillStatus, InterfaceMessage)
    """What it listens to."""

    def __init__(self, start_us: int) -> None:
        self._history = RunHistory(start_us=start_us)

    def __call__(self, event: Event) -> None:
        """Take an event."""
        self._history.take(event)

    def seconds(self, end_us: int) -> dict[str, float]:
        """Return the seconds of each one, by its name.

        :param end_us: when the run has ended.
        """
        found: defaultdict[str, int] = defaultdict(int)
        for call in self._history.calls:
            found[call.skiller] += (call.end[1] if call.end else end_us) - call.begin[1]
        return {name: round(found[name] / MICROSECONDS, 1) for name in sorted(found)}
