"""What a page about a run shows: goals, plan-actions, skills, rules, log and interfaces, each over time.

Times are microseconds since the first event. ``seq`` is the number of an event in the run, from 0: many
events have the same time, as all of a step of a virtual clock, and their order tells what led to what.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cxbridge.goaltree import Forest, parent_id
from cxbridge.trace.report.keeping import Kept
from cxbridge.trace.report.orders import Order

"""What the slot ``parent`` of a root goal says."""


@dataclass(frozen=True, slots=True)
class Limits:
    """How much of a run a page keeps; what is beyond is counted and told.

    :param goals: goals; those that come later are left out. ``actions`` and ``calls`` (of skills): likewise.
    :param transitions: of goals, and of plan-actions; beyond, only the first and the last of each are kept.
    :param log: lines of each level: the first and the last ones.
    :param writes: writes that changed an interface, the first and the last ones.
    :param firings: firings that can be seen one by one; all are counted.
    """

    goals: int = 10_000
    actions: int = 30_000
    calls: int = 10_000
    transitions: int = 300_000
    log: int = 50_000
    writes: int = 50_000
    firings: int = 100_000


@dataclass(slots=True)
class GoalState:
    """What a goal was from an event on."""

    seq: int
    time: int
    mode: str
    outcome: str
    error: str


@dataclass(slots=True)
class Goal:
    """A goal.

    :param number: its place in :attr:`RunModel.goals`.
    :param parent: the id of the parent that it had last.
    """

    number: int
    env: str
    goal: str
    goal_class: str
    sub_type: str
    parent: str
    states: list[GoalState] = field(default_factory=list)


@dataclass(slots=True)
class Action:
    """A plan-action.

    :param goal: number of its goal, None when that was not seen.
    :param states: seq, time, state.
    :param order: who is to execute it and with what, as far as facts tell.
    """

    number: int
    env: str
    goal: int | None
    goal_id: str
    plan: str
    action_id: str
    name: str
    states: list[tuple[int, int, str]] = field(default_factory=list)
    order: Order = field(default_factory=Order)

    @property
    def call(self) -> str:
        """Its name, and its arguments as far as they are known."""
        return " ".join((self.name, *self.order.arguments))


@dataclass(slots=True)
class SkillCall:
    """A skill that ran, from the first status to the last one.

    :param end: seq and time when it was over; None when the recording ends before.
    """

    env: str
    skiller: str
    skill_string: str
    msgid: int
    begin: tuple[int, int]
    end: tuple[int, int] | None
    status: str
    error: str = ""


@dataclass(slots=True)
class Span:
    """Something that is called and answered, as a planner.

    :param end: seq and time of the answer, None when there is none.
    """

    name: str
    goal: str
    begin: tuple[int, int]
    end: tuple[int, int] | None = None
    status: str = ""
    text: str = ""


@dataclass(slots=True)
class RuleCount:
    """How often a rule fired, and (seq, time) of its first and its last firing."""

    env: str
    name: str
    count: int
    first: tuple[int, int]
    last: tuple[int, int]


@dataclass(slots=True)
class InterfaceCount:
    """How often an interface was written, how often that changed anything, and when."""

    uid: str
    writes: int = 0
    changes: int = 0
    messages: int = 0
    first: int = 0
    last: int = 0


@dataclass(slots=True)
class RunModel:
    """A run as a page shows it.

    :param events: how many events the run has.
    :param end: time of the last one.
    :param start_us: the run's clock at the first one; None without events.
    :param firings: seq, time, and number of the rule in ``rules``.
    :param log: seq, time, number of the component in ``components``, text; by level.
    :param changes: seq, time, number of the interface in ``interfaces``, the fields that changed as texts.
    :param messages: seq, time, number of the interface, what was sent.
    :param facts: seq, time, and how many more facts than at the begin there were then; empty without facts.
    :param notes: what the reader must know, in whole sentences.
    """

    events: int = 0
    end: int = 0
    start_us: int | None = None
    goals: list[Goal] = field(default_factory=list)
    actions: list[Action] = field(default_factory=list)
    calls: list[SkillCall] = field(default_factory=list)
    spans: list[Span] = field(default_factory=list)
    rules: list[RuleCount] = field(default_factory=list)
    firings: Kept[tuple[int, int, int]] = field(default_factory=lambda: Kept(0))
    components: list[str] = field(default_factory=list)
    log: Mapping[str, Kept[tuple[int, int, int, str]]] = field(default_factory=dict)
    interfaces: list[InterfaceCount] = field(default_factory=list)
    changes: Kept[tuple[int, int, int, dict[str, str]]] = field(default_factory=lambda: Kept(0))
    messages: Kept[tuple[int, int, int, str]] = field(default_factory=lambda: Kept(0))
    facts: list[tuple[int, int, int]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def parents(goals: Sequence[Goal]) -> list[int | None]:
    """Return the number of each goal's parent; None for roots, and for one goal of each circle."""
    numbers = {(goal.env, goal.goal): goal.number for goal in goals}
    above = ((goal, parent_id(goal.parent)) for goal in goals)
    found = {
        goal.number: None if parent is None else numbers.get((goal.env, parent)) for goal, parent in above
    }
    return list(Forest(found).parents.values())
