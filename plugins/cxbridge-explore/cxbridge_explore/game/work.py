"""Records the skills that robots, or other executors of skills, execute in a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, SkillStatus
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.history.builder import RunHistory
from cxbridge.history.model import SkillExecution
from cxbridge.skiller.backend import DEFAULT_SKILLER
from cxbridge.skiller.status import Status
from cxbridge_explore.game.score import RobotWork
from cxbridge_explore.game.timeline import Span, Timeline, covered_seconds

if TYPE_CHECKING:
    from cxbridge.run.agent import Run


class SkillRecorder:
    """Records the skills that Skillers and executors execute. The event bus calls it with each event.

    :param start_us: the start of the run.
    """

    events = (SkillStatus, InterfaceMessage, InterfaceWrite)  # the event types to request from the event bus

    def __init__(self, start_us: int) -> None:
        self._history = RunHistory(start_us=start_us)

    def __call__(self, event: Event) -> None:
        self._history.record_event(event)

    def find_robot_spans(
        self, robots: Mapping[str, str], end_us: int, seconds_at: Callable[[int], float]
    ) -> dict[str, tuple[Span, ...]]:
        """Return the intervals of the skills of each robot.

        :param robots: the names of the robots, by the names of their Skillers and executors.
        :param end_us: the end of the run.
        :param seconds_at: converts a time to seconds since the start of the production phase.
        """
        clock = self._history.clock
        # the history counts from the first event, with a clock that is never set back
        steady_end_us, start_us = clock.advance_to(end_us), clock.first_us or 0
        spans_of_robots: dict[str, list[Span]] = {name: [] for name in sorted(set(robots.values()))}
        for call in self._history.calls:
            name = _find_performer(call)
            robot = robots.get(name, name)
            begin_s = seconds_at(start_us + call.begin.time)
            end_s = seconds_at(start_us + (call.end.time if call.end else steady_end_us))
            span = Span(begin_s, end_s, call.skill_string, call.status, call.error)
            spans_of_robots.setdefault(robot, []).append(span)
        return {robot: tuple(spans_of_robots[robot]) for robot in sorted(spans_of_robots)}


def find_robots(agents: Sequence[Run]) -> dict[str, str]:
    """Return the names of the robots of a run, by the names of their Skillers and executors."""
    robot_names = {}
    for agent in agents:
        board = agent.skill_board
        for member in () if board is None else board.agents:
            robot_names[member.name] = member.name
            if member.skiller != DEFAULT_SKILLER:
                robot_names[member.skiller] = member.name
            robot_names.update({executor.name: member.name for executor in member.executors})
    return robot_names


def summarize_work(timeline: Timeline) -> dict[str, RobotWork]:
    """Return the work of each robot during the production."""
    work_of_robots = {}
    for robot, spans in timeline.skills.items():
        failure_counts = Counter(
            span.error or "failed" for span in spans if span.status == Status.S_FAILED.name
        )
        busy, idle = round(covered_seconds(spans), 1), round(timeline.idle_seconds(robot), 1)
        work_of_robots[robot] = RobotWork(busy, idle, dict(failure_counts))
    return work_of_robots


def _find_performer(call: SkillExecution) -> str:
    """Return the name of the Skiller or executor; for the only Skiller of an agent, the agent's name."""
    if call.env in ("", ENVIRONMENT):
        return call.skiller
    return call.env if call.skiller == DEFAULT_SKILLER else f"{call.env}/{call.skiller}"
