"""The model of a run's history: goals, plan-actions, skills and planner calls, with their changes over time.

Times are microseconds since the start of the run. ``seq`` is the number of an event in the run, from 0: many
events have the same time, as all of a step of a virtual clock, and their order says what led to what.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
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


class SentCall(NamedTuple):
    """A message that sent a plan-action, as the executive says it.

    :param seq: of the first transition that names the message.
    :param skiller: id of the SkillerInterface; empty for a skill board.
    :param call: number of the message, or the name of the request on the skill board.
    """

    seq: int
    skiller: str
    call: str


@dataclass(slots=True, eq=False)
class GoalRecord:
    """A life of a goal: its changes, at least one, and the plan-actions that appeared after it.

    :param number: its place in :attr:`~cxbridge.history.builder.RunHistory.goals`.
    :param life: from 1: an agent may use the id of a goal whose fact is gone for another goal.
    :param replaced: seq when its next life began; None: there is none.
    """

    number: int
    env: str
    id: str
    goal_class: str
    sub_type: str
    changes: list[GoalChange] = field(default_factory=list)
    actions: list[PlanActionRecord] = field(default_factory=list, repr=False)
    life: int = 1
    replaced: int | None = None

    @property
    def name(self) -> str:
        """Its id; of a second life ``ID#2``."""
        return self.id if self.life == 1 else f"{self.id}#{self.life}"

    @property
    def last_actions(self) -> list[PlanActionRecord]:
        """The plan-actions since it was formulated last: a goal may be tried again with another plan."""
        since = max((change.seq for change in self.changes if change.mode == "FORMULATED"), default=0)
        return [action for action in self.actions if action.changes[-1].seq >= since]

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
        return goal_title(self.name, self.goal_class)

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
    :param sent: the messages that sent it; empty where the recording does not say it.
    :param params: its parameters as its first event has them: another plan-action may get the same ids later.
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
    sent: list[SentCall] = field(default_factory=list)
    params: str = ""

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
        """Its name, and its known arguments."""
        return " ".join((self.name, *self.order.arguments))


@dataclass(slots=True, eq=False)
class SkillExecution:
    """A skill that a Skiller ran, from the first status to the last one.

    :param begin: seq and time of the first status.
    :param end: of the last one; None when the run is at its end, or the moment is reached, before.
    :param error: the Skiller's reason of its failure.
    :param request: the name of the request on a skill board, or its number; empty for a Skiller's.
    """

    env: str
    skiller: str
    skill_string: str
    msgid: int
    begin: tuple[int, int]
    end: tuple[int, int] | None
    status: str
    error: str = ""
    request: str = ""

    @property
    def sent_as(self) -> tuple[str, str]:
        """Skiller and call of the :class:`SentCall` that names it."""
        return ("", self.request) if self.request else (self.skiller, str(self.msgid))


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
    lives: dict[tuple[str, str], list[GoalRecord]] = {}
    for goal in goals:
        lives.setdefault((goal.env, goal.id), []).append(goal)
    return Forest({goal.number: _parent_of(goal, lives) for goal in goals})


def _parent_of(goal: GoalRecord, lives: Mapping[tuple[str, str], Sequence[GoalRecord]]) -> int | None:
    """Return the number of the parent: of several lives of its id the one that there was."""
    above = parent_id(goal.parent)
    known = () if above is None else lives.get((goal.env, above), ())
    *_, since = (each.seq for each in takewhile(lambda each: each.parent == goal.parent, goal.changes[::-1]))
    begun = [parent for parent in known if parent.changes[0].seq <= since]
    return begun[-1].number if begun else known[0].number if known else None


def goals_named(goals: Sequence[GoalRecord], name: str) -> list[GoalRecord]:
    """Return the goals that a name stands for, in their order; none when there is none.

    :param name: an id, which may have several lives; ``ID#2``, one of the lives; a class; ``CLASS#2``, one of
        the goals of a class; or the start of ids.
    """
    stem, _, digits = name.rpartition("#")
    for of_name, of_stem in (
        ([goal for goal in goals if goal.id == name], [goal for goal in goals if goal.id == stem]),
        (
            [goal for goal in goals if goal.goal_class == name],
            [goal for goal in goals if goal.goal_class == stem],
        ),
    ):
        if of_name:
            return of_name
        if of_stem and digits.isdigit():
            return of_stem[max(0, int(digits) - 1) : int(digits)]
    return [goal for goal in goals if goal.id.startswith(name)]


def goal_tree(goals: Sequence[GoalRecord]) -> list[str]:
    """Return goals as lines, those of a parent below it."""
    return [f"{branch}{goals[number]}" for number, branch in drawn(goal_forest(goals))] or ["no goal yet"]
