"""What came of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cxbridge.executive.goals import GoalState

if TYPE_CHECKING:
    from cxbridge.app.replay.verdict import ReplayOutcome

COMPLETED, UNSUCCESSFUL, BAD_INPUT, TIMED_OUT, FAULT = range(5)
"""The exit statuses of ``cxbridge run``."""

_WORDS = {
    COMPLETED: "completed",
    UNSUCCESSFUL: "unsuccessful",
    BAD_INPUT: "bad input",
    TIMED_OUT: "timed out",
    FAULT: "fault",
}

_REPLAY_WORDS = _WORDS | {COMPLETED: "the same", UNSUCCESSFUL: "different"}


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    :param status: the exit status.
    :param reason: why, in a sentence.
    :param spec: the spec that was run.
    :param goals: the last that was seen of each goal, in the order they appeared.
    :param loops: loops of the main loop.
    :param firings: rules fired.
    :param run_seconds: time of the run's clock.
    :param wall_seconds: real time.
    :param replay: what came of a replay; None: it was none, or did not come to its end.
    """

    status: int
    reason: str
    spec: str
    goals: tuple[GoalState, ...]
    loops: int
    firings: int
    run_seconds: float
    wall_seconds: float
    replay: ReplayOutcome | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON can have it."""
        more = {} if self.replay is None else {"replay": self.replay.plain()}
        return {
            "status": self.status,
            "result": self._word,
            "reason": self.reason,
            "spec": self.spec,
            "loops": self.loops,
            "firings": self.firings,
            "run_seconds": round(self.run_seconds, 6),
            "wall_seconds": round(self.wall_seconds, 3),
            "goals": [
                {
                    "id": goal.goal,
                    "class": goal.goal_class,
                    "parent": goal.parent,
                    "mode": goal.mode,
                    "outcome": goal.outcome,
                    "error": goal.error,
                }
                for goal in self.goals
            ],
            **more,
        }

    @property
    def _word(self) -> str:
        if self.replay is None:
            return _WORDS[self.status]
        return _REPLAY_WORDS[self.status]

    def summary(self) -> str:
        """Return it for people: the goal tree with its outcomes, and one line on the whole."""
        lines: list[str] = []
        for goal in self.goals:
            if goal.is_root:
                self._tree(goal, "", "", lines)
        lines += () if self.replay is None else self.replay.lines
        lines.append(f"{self.spec}: {self._word}, {self.reason}")
        lines.append(
            f"{self.run_seconds:.1f} s of the run's clock in {self.wall_seconds:.2f} s: "
            f"{self.loops} loops, {self.firings} rules fired"
        )
        return "\n".join(lines)

    def _tree(self, goal: GoalState, first: str, rest: str, lines: list[str]) -> None:
        """Append the lines of a goal and those below it."""
        state = goal.outcome if goal.outcome not in ("UNKNOWN", "") else goal.mode
        error = f"  [{goal.error}]" if goal.error else ""
        lines.append(f"{first}{goal.goal} ({goal.goal_class}): {state}{error}")
        children = [other for other in self.goals if other.parent == goal.goal]
        for child in children:
            last = child is children[-1]
            branch, stem = ("└─ ", "   ") if last else ("├─ ", "│  ")
            self._tree(child, rest + branch, rest + stem, lines)
