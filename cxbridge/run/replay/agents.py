"""One agent's part of a recording of several agents, as if it had been alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from msgspec.structs import replace

from cxbridge.errors import TraceError
from cxbridge.events import (
    Event,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
)
from cxbridge.run.replay.recordings import Recordings
from cxbridge.run.replay.scan import take_all
from cxbridge.trace.formats.base import Run

_OF_ENVIRONMENTS: Final = (GoalTransition, PlanActionTransition, SkillStatus, PlannerCall)


class RecordedAgentRun(Run):
    """The events of one agent.

    :param run: the recording of all.
    :param agent: its name: that of its environment, and what precedes the ids of its interfaces.
    """

    def __init__(self, run: Run, agent: str) -> None:
        super().__init__(run.path, run.registry)
        self.format = run.format
        self.notes = run.notes
        self._run = run
        self._agent = agent

    def __iter__(self) -> Iterator[Event]:
        """Yield its events; ids of interfaces are as on its own blackboard."""
        before = f"{self._agent}/"
        for event in self._run:
            if isinstance(event, InterfaceWrite | InterfaceMessage):
                kind, mark, name = event.uid.partition("::")
                if name.startswith(before):
                    yield replace(event, uid=f"{kind}{mark}{name.removeprefix(before)}")
            elif isinstance(event, _OF_ENVIRONMENTS) and event.env == self._agent:
                yield event


def recordings_of(whole: Recordings, agent: str) -> Recordings:
    """Return what is known about one agent of a recorded run.

    :raises TraceError: when there is nothing of it.
    """
    scans = []
    for each in whole.scans:
        own = take_all(RecordedAgentRun(each.run, agent))
        own.shift_us, own.metadata, own.begin_us = each.shift_us, each.metadata, each.begin_us
        scans.append(own)
    if not any(scan.transitions or scan.samples for scan in scans):
        raise TraceError(
            f"it has nothing of the agent '{agent}'",
            file=whole.scans[0].run.path,
            hint="the recording must be of all agents in one run; one alone is replayed with --agent",
        )
    decisions = next((scan for scan in scans if scan.goals), None)
    decisions = decisions or next((scan for scan in scans if scan.statuses), scans[0])
    return Recordings(tuple(scans), decisions, whole.start_us)
