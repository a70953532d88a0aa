"""The result of a run, as text for users and as JSON values for programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field
from msgspec.structs import replace

from cxbridge.history.tree import GoalLine, NamedGoal, goal_as_json, goal_lines
from cxbridge.printing import one_line

if TYPE_CHECKING:
    from cxbridge.run.replay.divergence import Divergence

COMPLETED, UNSUCCESSFUL, BAD_INPUT, TIMED_OUT, FAULT = range(5)
"""The exit statuses of ``cxbridge run``."""

_RESULT_WORDS = {
    COMPLETED: "completed",
    UNSUCCESSFUL: "unsuccessful",
    BAD_INPUT: "bad input",
    TIMED_OUT: "timed out",
    FAULT: "fault",
}

_REPLAY_RESULT_WORDS = _RESULT_WORDS | {COMPLETED: "the same", UNSUCCESSFUL: "different"}


class ReplayOutcome(Struct, frozen=True):
    """The result of a replay.

    :param compared: the path of the compared recording.
    :param order: the compared order, ``total`` or ``partial``.
    :param divergence: the first differing command; None if there is none.
    :param same: whether the transitions are equal, in the compared order.
    :param is_complete: whether the recording reaches the end of its run; otherwise only its time span is
        compared.
    :param lines: the lines of the comparison as text; empty after a divergence.
    :param report: the comparison as JSON values; empty without a comparison.
    """

    compared: str
    order: str
    divergence: Divergence | None
    same: bool
    is_complete: bool
    lines: tuple[str, ...] = ()
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def reason(self) -> str:
        """The result in a sentence."""
        if self.divergence is not None:
            return f"it decided something else: {self.divergence}"
        if not self.same:
            return f"it decided something else than {self.compared}, in {self.order} order"
        limit = "" if self.is_complete else ", up to where the recording ends"
        return f"it decided the same as {self.compared}, in {self.order} order{limit}"

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        return {
            "compared": self.compared,
            "order": self.order,
            "same": self.same and self.divergence is None,
            "whole": self.is_complete,
            "divergence": None if self.divergence is None else self.divergence.to_json(),
            "comparison": self.report,
        }


class RunResult(Struct, frozen=True):
    """The result of a run.

    :param status: the exit status of ``cxbridge run``, e.g. :data:`COMPLETED`.
    :param reason: the reason for the status in a sentence.
    :param spec: the spec of the agent; the specs of a team, separated by spaces.
    :param goals: the last state of each goal, in order of appearance; in a long run, only the latest goals.
    :param is_stuck: whether the run ended early because no event could follow.
    :param forgotten_goal_count: the number of earlier goals that are not in ``goals``.
    :param loops: the number of cycles of the main loop.
    :param firings: the number of rule firings.
    :param run_seconds: the duration by the run's clock.
    :param wall_seconds: the duration in real time.
    :param replay: the result of a replay; None without a finished replay.
    :param agents: the results by agent of a team, whose own ``goals`` is empty; empty for a single agent.
    """

    status: int
    reason: str
    spec: str
    goals: tuple[NamedGoal, ...]
    loops: int
    firings: int
    run_seconds: float
    wall_seconds: float
    replay: ReplayOutcome | None = None
    agents: Mapping[str, RunResult] = field(default_factory=dict)
    forgotten_goal_count: int = 0
    is_stuck: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        optional_members: dict[str, Any] = {} if self.replay is None else {"replay": self.replay.to_json()}
        if self.agents:
            optional_members["agents"] = {name: result.to_json() for name, result in self.agents.items()}
        return {
            "status": self.status,
            "result": self.word,
            "reason": self.reason,
            "spec": self.spec,
            "loops": self.loops,
            "firings": self.firings,
            "run_seconds": round(self.run_seconds, 6),
            "wall_seconds": round(self.wall_seconds, 3),
            "goals": [goal_as_json(goal) for goal in self.goals],
            "forgotten_goals": self.forgotten_goal_count,
            **optional_members,
        }

    @property
    def word(self) -> str:
        """The result in one or two words."""
        words = _RESULT_WORDS if self.replay is None else _REPLAY_RESULT_WORDS
        return "stuck" if self.is_stuck else words[self.status]

    def summary(self) -> str:
        """Return the goal tree with outcomes, and a line about the run."""
        replay_lines = () if self.replay is None else self.replay.lines
        lines = (*self.goal_lines(), *replay_lines, self.verdict + self.figures)
        return "\n".join(map(one_line, lines))  # error texts may contain control characters

    @property
    def verdict(self) -> str:
        """The spec, the result and the reason as a text."""
        return f"{self.spec}: {self.word}, {self.reason}"

    @property
    def figures(self) -> str:
        """The durations and the number of firings, as text that follows :attr:`verdict` in the summary."""
        return (
            f"; {self.run_seconds:.1f} s of the run's clock in {self.wall_seconds:.2f} s, "
            f"{self.firings} rules fired"
        )

    def tree(self) -> Iterator[GoalLine | str]:
        """Yield the lines of the goal tree; in a team, below the name of each agent.

        The names, and the note about goals that are not listed, are plain texts.
        """
        for name, result in self.agents.items():
            yield name
            for line in result.tree():
                yield f"  {line}" if isinstance(line, str) else replace(line, branch=f"  {line.branch}")
        if self.forgotten_goal_count:
            yield f"({self.forgotten_goal_count} earlier goals are not listed)"
        yield from goal_lines(self.goals)

    def goal_lines(self) -> list[str]:
        """Return the lines of the goal tree."""
        return [line if isinstance(line, str) else line.text for line in self.tree()]


def sum_up(agents: Mapping[str, RunResult]) -> RunResult:
    """Return the combined result of a team, with the worst status; the result of a single agent unchanged."""
    results = list(agents.values())
    if len(results) == 1:
        return results[0]
    # the statuses are ordered by severity, except bad input, which raises an error instead
    status = max(result.status for result in results)
    worst_reasons = {name: result.reason for name, result in agents.items() if result.status == status}
    is_shared = len(set(worst_reasons.values())) == 1 and len(worst_reasons) == len(agents)
    # a reason that all agents share, such as a lost blackboard, is said once
    reasons = (
        [results[0].reason] if is_shared else [f"{name}: {reason}" for name, reason in worst_reasons.items()]
    )
    return replace(
        results[0],
        status=status,
        reason="; ".join(reasons),
        spec=" ".join(dict.fromkeys(result.spec for result in results)),
        goals=(),
        forgotten_goal_count=0,  # the tree notes those of each agent
        is_stuck=status == TIMED_OUT and any(result.is_stuck for result in results),
        firings=sum(result.firings for result in results),
        agents=dict(agents),
    )
