"""The model of a run's history: goals, plan-actions, skills and planner calls, with their changes over time.

Times are microseconds since the start of the run. ``seq`` is the number of an event in the run, from 0: many
events have the same time, as all of a step of a virtual clock, and their order says what led to what.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from cxbridge.clock import MICROSECONDS
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.orders import ActionOrder
from cxbridge.history.outcome import ENDED_MODES
from cxbridge.history.tree import drawn, goal_title

DONE_STATES: Final = ("FINAL", "FAILED")
"""States of a plan-action that is over."""


class GoalChange(NamedTuple):
    """The state of a goal from an event on."""

    seq: int
    time: int
    mode: str
    outcome: str
    error: str
    parent: str


class ActionChange(NamedTuple):
    """The state of a plan-action from an event on."""

    seq: int
    time: int
    state: str


@dataclass(slots=True, eq=False)
class GoalRecord:
    """A goal: its changes, at least one, and the plan-actions that appeared after it.

    :param number: its place in :attr:`~cxbridge.history.builder.RunHistory.goals`.
    """

    number: int
    env: str
    id: str
    goal_class: str
    sub_type: str
    changes: list[GoalChange] = field(default_factory=list)
    actions: list[PlanActionRecord] = field(default_factory=list, repr=False)

    @property
    def parent(self) -> str:
        """The slot ``parent``: an id, or ``nil``."""
        return self.changes[-1].parent

    @property
    def mode(self) -> str:
        """Its last mode."""
        return self.changes[-1].mode

    @property
    def outcome(self) -> str:
        """Its last outcome, ``UNKNOWN`` for none yet."""
        return self.changes[-1].outcome

    @property
    def error(self) -> str:
        """Its last error."""
        return self.changes[-1].error

    @property
    def title(self) -> str:
        """Its id and class."""
        return goal_title(self.id, self.goal_class)

    @property
    def history(self) -> list[tuple[float, str, str]]:
        """Seconds since the run began, mode and outcome of each transition."""
        return [(change.time / MICROSECONDS, change.mode, change.outcome) for change in self.changes]

    @property
    def modes(self) -> list[str]:
        """The modes that it went through, each once in a row."""
        modes: list[str] = []
        for change in self.changes:
            if modes[-1:] != [change.mode]:
                modes.append(change.mode)
        return modes

    @property
    def ended(self) -> GoalChange | None:
        """The change that gave it its present outcome; None when it has none (any more)."""
        found = None
        for change in reversed(self.changes):
            if change.mode not in ENDED_MODES:
                break
            found = change
        return found

    @property
    def former_ends(self) -> list[GoalChange]:
        """The changes that gave it outcomes before: a goal may be formulated again."""
        last = self.ended
        return [change for change in self.changes if change.mode == "FINISHED" and change is not last]

    def __str__(self) -> str:
        known = self.outcome not in ("", "UNKNOWN")
        error = f"  [{self.error}]" if self.error else ""
        return f"{self.title}: {self.mode}{f' {self.outcome}' if known else ''}{error}"


@dataclass(slots=True, eq=False)
class PlanActionRecord:
    """A plan-action: its changes, at least one.

    :param number: its place in :attr:`~cxbridge.history.builder.RunHistory.actions`.
    :param goal: id of its goal, and ``plan`` of its plan.
    :param goal_record: its goal, None when that was not seen before.
    :param order: who is to execute it and with what, as far as facts show.
    """

    number: int
    env: str
    goal: str
    goal_record: GoalRecord | None = field(repr=False)
    plan: str
    id: str
    name: str
    changes: list[ActionChange] = field(default_factory=list)
    order: ActionOrder = field(default_factory=ActionOrder)

    @property
    def state(self) -> str:
        """Its last state."""
        return self.changes[-1].state

    @property
    def states(self) -> list[str]:
        """The states that it went through."""
        return [change.state for change in self.changes]

    @property
    def text(self) -> str:
        """Its name, and its arguments as far as they are known."""
        return " ".join((self.name, *self.order.arguments))


@dataclass(slots=True, eq=False)
class SkillExecution:
    """A skill that a Skiller ran, from the first status to the last one.

    :param begin: seq and time of the first status.
    :param end: of the last one; None when the run is at its end, or the moment is reached, before.
    :param error: what the Skiller gave as the reason of its failure.
    """

    env: str
    skiller: str
    skill_string: str
    msgid: int
    begin: tuple[int, int]
    end: tuple[int, int] | None
    status: str
    error: str = ""


@dataclass(slots=True, eq=False)
class PlannerExecution:
    """A planner that was called.

    :param end: seq and time of the answer, None when there is none.
    """

    name: str
    goal: str
    begin: tuple[int, int]
    end: tuple[int, int] | None = None
    status: str = ""
    text: str = ""


def goal_forest(goals: Sequence[GoalRecord]) -> Forest[int]:
    """Return the trees of goals, by their numbers; of goals in a circle one is a root."""
    numbers = {(goal.env, goal.id): goal.number for goal in goals}
    above = ((goal, parent_id(goal.parent)) for goal in goals)
    return Forest(
        {goal.number: None if parent is None else numbers.get((goal.env, parent)) for goal, parent in above}
    )


def goal_tree(goals: Sequence[GoalRecord]) -> list[str]:
    """Return goals as lines, those of a parent below it."""
    return [f"{branch}{goals[number]}" for number, branch in drawn(goal_forest(goals))] or ["no goal yet"]
