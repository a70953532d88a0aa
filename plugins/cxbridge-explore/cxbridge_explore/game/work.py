"""The work of the robots, or of other executors of skills, in a game."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.history.builder import RunHistory
from cxbridge.history.model import SkillExecution
from cxbridge.skiller.backend import DEFAULT_SKILLER
from cxbridge.skiller.status import Status
from cxbridge_explore.game.judge import GameWatch
from cxbridge_explore.game.score import RobotWork

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

Span = tuple[float, float]  # begin and end in seconds since the start of the production


def find_robots(agents: Sequence[Run]) -> dict[str, str]:
    """Return the names of the robots of a run, by the names of their Skillers and executors."""
    robot_names = {}
    for agent in agents:
        board = agent.skill_board
        for member in () if board is None else board.agents:
            robot_names[member.name] = member.name
            # each agent of a team may have a default Skiller, whose calls get the name of the agent
            if member.skiller != DEFAULT_SKILLER:
                robot_names[member.skiller] = member.name
            robot_names.update({executor.name: member.name for executor in member.executors})
    return robot_names


def summarize_work(
    history: RunHistory, robots: Mapping[str, str], end_us: int, watch: GameWatch
) -> dict[str, RobotWork]:
    """Return the work of each robot.

    :param history: the history of the run, with its skill calls.
    :param robots: the names of the robots, by the names of their Skillers and executors.
    :param end_us: the end of the run, by its clock.
    :param watch: knows the start and the end of the production.
    """
    # the history counts from the start of the run, with a clock that is never set back
    steady_end_us, start_us = history.clock.advance_to(end_us), history.clock.start_us or 0
    spans: dict[str, list[Span]] = {robot: [] for robot in robots.values()}
    failures: dict[str, Counter[str]] = {}
    for call in history.calls:
        performer = _find_performer(call)
        robot = robots.get(performer, performer)
        call_end_us = call.end.time if call.end else steady_end_us
        span = watch.seconds_at(start_us + call.begin.time), watch.seconds_at(start_us + call_end_us)
        spans.setdefault(robot, []).append(span)
        if call.status == Status.S_FAILED.name:
            failures.setdefault(robot, Counter())[call.error or "failed"] += 1
    production_seconds, work_by_robot = watch.production_seconds, {}
    for robot in sorted(spans):
        production_spans = [(max(0.0, begin), min(production_seconds, end)) for begin, end in spans[robot]]
        busy_s, idle_s = covered_seconds(spans[robot]), production_seconds - covered_seconds(production_spans)
        work_by_robot[robot] = RobotWork(round(busy_s, 1), round(idle_s, 1), dict(failures.get(robot, {})))
    return work_by_robot


def covered_seconds(spans: Iterable[Span]) -> float:
    """Return the length of the union of intervals, which may overlap: a robot may have several executors."""
    total, covered_until = 0.0, float("-inf")
    for begin, end in sorted(spans):
        total += max(0.0, end - max(begin, covered_until))
        covered_until = max(covered_until, end)
    return total


def _find_performer(call: SkillExecution) -> str:
    """Return the name of the Skiller or executor.

    In a team, the name begins with the agent's, and the agent's name alone stands for its default Skiller.
    """
    if call.env in ("", ENVIRONMENT):
        return call.skiller
    return call.env if call.skiller == DEFAULT_SKILLER else f"{call.env}/{call.skiller}"
