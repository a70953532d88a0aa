"""What each executor of skills did in a run: how long it was busy, and what failed."""

from __future__ import annotations

from collections import Counter, defaultdict

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, SkillStatus
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.game.score import RobotWork
from cxbridge.history.builder import RunHistory
from cxbridge.history.model import SkillExecution
from cxbridge.skiller.backend import DEFAULT_SKILLER
from cxbridge.skiller.status import Status


class WorkCount:
    """Adds up the executions of Skillers and of a skill board's executors; a sink of events.

    :param start_us: when the run begins.
    """

    events = (SkillStatus, InterfaceMessage, InterfaceWrite)
    """What it listens to."""

    def __init__(self, start_us: int) -> None:
        self._history = RunHistory(start_us=start_us)

    def __call__(self, event: Event) -> None:
        """Take an event."""
        self._history.take(event)

    def by_name(self, end_us: int) -> dict[str, RobotWork]:
        """Return the work of each one, by its name.

        :param end_us: when the run has ended.
        """
        busy: defaultdict[str, int] = defaultdict(int)
        failed: defaultdict[str, Counter[str]] = defaultdict(Counter)
        end = self._history.clock.at(end_us)
        for call in self._history.calls:
            name = _name(call)
            busy[name] += (call.end[1] if call.end else end) - call.begin[1]
            if call.status == Status.S_FAILED.name:
                failed[name][call.error or "failed"] += 1
        return {
            name: RobotWork(round(busy[name] / MICROSECONDS, 1), dict(failed[name])) for name in sorted(busy)
        }


def _name(call: SkillExecution) -> str:
    """Return who executes: of several agents, each with one Skiller, the agent."""
    if call.env in ("", ENVIRONMENT):
        return call.skiller
    return call.env if call.skiller == DEFAULT_SKILLER else f"{call.env}/{call.skiller}"
