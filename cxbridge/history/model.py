"""The model of a run's history: goals, plan-actions, skills and planner calls with their changes.

Times are microseconds since the start of the run. ``seq`` is the number of an event in the run, from 0. Many
events have equal times, for example all events of a step of a virtual clock, so only their order shows
causes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, takewhile
from typing import Final, NamedTuple

from cxbridge.clock import MICROSECONDS
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.outcome import ENDED_MODES
from cxbridge.history.transitions import unquote
from cxbridge.history.tree import draw_branches, goal_title
from cxbridge.numbers import parse_decimal

DONE_STATES: Final = ("FINAL", "FAILED")
"""The final states of a plan-action."""

PLAN_ACTION: Final = "plan-action"
"""The deftemplate of plan-actions."""

# the statuses of Skillers in events, as in Fawkes' SkillerInterface
SKILL_IDLE: Final = "S_INACTIVE"
SKILL_RUNNING: Final = "S_RUNNING"
SKILL_FINAL: Final = "S_FINAL"
SKILL_FAILED: Final = "S_FAILED"
SKILL_ENDED: Final = (SKILL_FINAL, SKILL_FAILED)

_PRINTED_FIELD = re.compile(r'"[^"]*"|[^\s"]+')
_SKILL_STRING_WORD = re.compile(r"[^\s{}()=,\"']+")

ActionKey = tuple[str, str, str]
"""The ids of goal, plan and action."""


class Moment(NamedTuple):
    """The place of an event in a run.

    :param seq: the number of the event, from 0.
    :param time: microseconds since the start of the run.
    """

    seq: int
    time: int


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

    @property
    def moment(self) -> Moment:
        """The place of the event in the run."""
        return Moment(self.seq, self.time)


class SentCall(NamedTuple):
    """A recorded message by which a plan-action was sent.

    :param seq: the seq of the first transition that names the message.
    :param skiller: the id of the SkillerInterface, empty for a skill board.
    :param call: the id of the message, or the name of the request on the skill board.
    """

    seq: int
    skiller: str
    call: str


@dataclass(slots=True, eq=False)
class GoalRecord:
    """A life of a goal, from its formulation on: at least one change, and the plan-actions of the goal.

    :param number: the index of the goal in :attr:`~cxbridge.history.builder.RunHistory.goals`.
    :param life: the number of the life, from 1, because the id of a retracted goal may be reused.
    :param replaced_seq: the seq at which the next life starts; None for the last life.
    """

    number: int
    env: str
    id: str
    goal_class: str
    sub_type: str
    changes: list[GoalChange] = field(default_factory=list)
    actions: list[PlanActionRecord] = field(default_factory=list, repr=False)
    life: int = 1
    replaced_seq: int | None = None

    @property
    def name(self) -> str:
        """The id; for a later life ``ID#2``."""
        return self.id if self.life == 1 else f"{self.id}#{self.life}"

    @property
    def former_seq(self) -> int:
        """The seq of the last change before the present attempt, 0 for the first attempt.

        A rule that tries a goal again sets the goal to FORMULATED, or from an ended mode to any earlier mode.
        """
        return max(
            (
                former_change.seq
                for former_change, change in pairwise(self.changes)
                if change.mode not in (former_change.mode, *ENDED_MODES)
                and (former_change.mode in ENDED_MODES or change.mode == "FORMULATED")
            ),
            default=0,
        )

    @property
    def last_actions(self) -> list[PlanActionRecord]:
        """The plan-actions of the present attempt: a goal may be tried again with another plan."""
        former_seq = self.former_seq
        return [action for action in self.actions if action.changes[-1].seq >= former_seq]

    @property
    def parent(self) -> str:
        """The slot ``parent``: an id, or ``nil``."""
        return self.changes[-1].parent

    @property
    def mode(self) -> str:
        """The present mode."""
        return self.changes[-1].mode

    @property
    def outcome(self) -> str:
        """The last outcome, ``UNKNOWN`` before the end."""
        return self.changes[-1].outcome

    @property
    def error(self) -> str:
        """The last error."""
        return self.changes[-1].error

    @property
    def title(self) -> str:
        """The id and class."""
        return goal_title(self.name, self.goal_class)

    @property
    def history(self) -> list[tuple[float, str, str]]:
        """Seconds since the start of the run, mode and outcome of each transition."""
        return [(change.time / MICROSECONDS, change.mode, change.outcome) for change in self.changes]

    @property
    def modes(self) -> list[str]:
        """The modes in order, without repetitions in a row."""
        modes: list[str] = []
        for change in self.changes:
            if modes[-1:] != [change.mode]:
                modes.append(change.mode)
        return modes

    @property
    def end_change(self) -> GoalChange | None:
        """The change that ended the present attempt; None before the end."""
        end = None
        # usually FINISHED, which sets the outcome; EVALUATED and RETRACTED repeat the outcome
        for change in reversed(self.changes):
            if change.mode not in ENDED_MODES:
                break
            end = change
        return end

    @property
    def former_end_changes(self) -> list[GoalChange]:
        """The changes that set earlier outcomes: a goal may be formulated again."""
        last_end = self.end_change
        return [change for change in self.changes if change.mode == "FINISHED" and change is not last_end]

    def __str__(self) -> str:
        has_outcome = self.outcome not in ("", "UNKNOWN")
        error = f"  [{self.error}]" if self.error else ""
        return f"{self.title}: {self.mode}{f' {self.outcome}' if has_outcome else ''}{error}"


@dataclass(frozen=True, slots=True)
class ActionAssignment:
    """The executor and arguments of a plan-action, as far as facts show them.

    :param skiller: the executor, empty if the agent's core has no such slot.
    :param arguments: values of the parameters, strings without quotes.
    """

    skiller: str = ""
    arguments: tuple[str, ...] = ()

    def count_arguments_in(self, skill_string: str) -> int:
        """Return the number of arguments that a skill string contains."""
        words = set(_SKILL_STRING_WORD.findall(skill_string))
        return sum(value in words for value in self.arguments)


def read_assignment(slots: Mapping[str, str]) -> tuple[ActionKey, ActionAssignment]:
    """Return the key of a plan-action's fact, and its assignment.

    :param slots: the slots of the fact, as CLIPS prints their values.
    """
    key = slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("id", "")
    return key, ActionAssignment(
        unquote(slots.get("skiller", "")), split_fields(slots.get("param-values", ""))
    )


def split_fields(text: str) -> tuple[str, ...]:
    """Return the fields of a printed multislot, strings without quotes."""
    return tuple(unquote(word) for word in _PRINTED_FIELD.findall(text))


@dataclass(slots=True, eq=False)
class PlanActionRecord:
    """A plan-action with at least one change.

    :param number: the index of the plan-action in :attr:`~cxbridge.history.builder.RunHistory.actions`.
    :param goal: the id of its goal.
    :param goal_record: the life of its goal; None if the goal was not recorded.
    :param plan: the id of its plan.
    :param assignment: updated by the last fact of the action.
    :param sent_calls: the messages that sent the plan-action, empty if they are not recorded.
    :param params: the parameters in the first event; other parameters show that the ids are reused.
    """

    number: int
    env: str
    goal: str
    goal_record: GoalRecord | None = field(repr=False)
    plan: str
    id: str
    name: str
    changes: list[ActionChange] = field(default_factory=list)
    assignment: ActionAssignment = field(default_factory=ActionAssignment)
    sent_calls: list[SentCall] = field(default_factory=list)
    params: str = ""

    @property
    def state(self) -> str:
        """The last state."""
        return self.changes[-1].state

    @property
    def states(self) -> list[str]:
        """The states in order."""
        return [change.state for change in self.changes]

    @property
    def text(self) -> str:
        """The name and the known arguments."""
        return " ".join((self.name, *self.assignment.arguments))


@dataclass(slots=True, eq=False)
class SkillExecution:
    """A skill that a Skiller executed, from its first to its last status.

    :param begin: the moment of the first status.
    :param end: the moment of the last status; None if the skill runs.
    :param status: the last status of the Skiller, or ``stopped`` for a skill that ended without a report.
    :param request: the name or number of the request on a skill board, empty for a Skiller.
    """

    env: str
    skiller: str
    skill_string: str
    msgid: int
    begin: Moment
    end: Moment | None
    status: str
    error: str = ""
    request: str = ""

    @property
    def call_key(self) -> tuple[str, str]:
        """The Skiller and call of the :class:`SentCall` that names this execution."""
        return ("", self.request) if self.request else (self.skiller, str(self.msgid))


@dataclass(slots=True, eq=False)
class PlannerExecution:
    """A call of a planner.

    :param begin: the moment of the start.
    :param end: the moment of the result; None without a result.
    :param status: the status of the result, as in :class:`~cxbridge.events.PlannerCall`; empty without a
        result.
    :param text: the goal formula; after the end also the result and the duration.
    """

    name: str
    goal: str
    begin: Moment
    end: Moment | None = None
    status: str = ""
    text: str = ""


def goal_forest(goals: Sequence[GoalRecord]) -> Forest[int]:
    """Return the trees of goals by number."""
    lives: dict[tuple[str, str], list[GoalRecord]] = {}
    for goal in goals:
        lives.setdefault((goal.env, goal.id), []).append(goal)
    return Forest({goal.number: _parent_number(goal, lives) for goal in goals})


def _parent_number(goal: GoalRecord, lives: Mapping[tuple[str, str], Sequence[GoalRecord]]) -> int | None:
    """Return the number of the parent, in the life that existed when the goal got this parent.

    None for a root, and for a parent that was not recorded.
    """
    parent = parent_id(goal.parent)
    parents = () if parent is None else lives.get((goal.env, parent), ())
    # the first of the last changes with the present parent
    *_, first_seq = (
        change.seq for change in takewhile(lambda change: change.parent == goal.parent, goal.changes[::-1])
    )
    # a goal may name its parent before the parent is formulated: the slot then means the first life
    earlier_lives = [life for life in parents if life.changes[0].seq <= first_seq]
    return earlier_lives[-1].number if earlier_lives else parents[0].number if parents else None


def find_goals(goals: Sequence[GoalRecord], name: str) -> list[GoalRecord]:
    """Return the goals that a name denotes, in order; empty if there are none.

    :param name: an id, which may have several lives; ``ID#2``, one of the lives; a class; ``CLASS#2``, one of
        the goals of a class; or the start of ids.
    """
    # an id may contain `#2` itself, so a complete id or class takes precedence
    stem, _, digits = name.rpartition("#")
    number = parse_decimal(digits)
    for named_goals, numbered_goals in (
        ([goal for goal in goals if goal.id == name], [goal for goal in goals if goal.id == stem]),
        (
            [goal for goal in goals if goal.goal_class == name],
            [goal for goal in goals if goal.goal_class == stem],
        ),
    ):
        if named_goals:
            return named_goals
        if numbered_goals and number is not None:
            return numbered_goals[max(0, number - 1) : number]
    return [goal for goal in goals if goal.id.startswith(name)]


def goal_tree(goals: Sequence[GoalRecord]) -> list[str]:
    """Return goals as the lines of a tree; without goals, a line that says so."""
    return [f"{branch}{goals[number]}" for number, branch in draw_branches(goal_forest(goals))] or [
        "no goal yet"
    ]
