"""The goals and plans of a run, each with the sequence of its own transitions."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from sys import intern
from typing import TypeAlias

from cxbridge.events import GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.trace.compare.naming import anonymous
from cxbridge.trace.compare.streams import Streams
from cxbridge.trace.formats.base import Run

GoalKey: TypeAlias = tuple[str, str]
"""Environment and id of a goal."""

State: TypeAlias = tuple[str, str, str]
"""Of a goal: mode, outcome, error. Of a plan: action id, action, state."""


@dataclass(slots=True)
class Sequence:
    """Transitions of one goal or plan, in order.

    :param states: the states one after the other.
    :param positions: the number of each transition among all of the run, from 0.
    """

    states: list[State] = field(default_factory=list)
    positions: list[int] = field(default_factory=list)

    def append(self, state: State, position: int) -> None:
        """Add a transition."""
        self.states.append(state)
        self.positions.append(position)


@dataclass(slots=True)
class Goal:
    """A goal and its plans.

    :param parent: the parent it had last, None for none.
    :param plans: by plan id.
    :param named_by: kind of each goal that names this one in an error, and at which of its transitions.
    """

    key: GoalKey
    goal_class: str = "?"
    sub_type: str = "?"
    parent: GoalKey | None = None
    own: Sequence = field(default_factory=Sequence)
    plans: dict[str, Sequence] = field(default_factory=dict)
    children: list[Goal] = field(default_factory=list)
    named_by: list[tuple[tuple[str, ...], int]] = field(default_factory=list)

    @property
    def kind(self) -> tuple[str, str, str, str]:
        """What tells siblings apart: environment, class, sub-type, and the id without its number."""
        return (self.key[0], self.goal_class, self.sub_type, anonymous(self.key[1]))

    @property
    def start(self) -> int:
        """The position of its first transition."""
        first = self.own.positions[:1] + [plan.positions[0] for plan in self.plans.values()]
        return min(first)

    def before(self, inner: Sequence) -> list[int]:
        """Return, for each transition of a child or plan, how many of this goal's own came before it."""
        return [bisect_left(self.own.positions, position) for position in inner.positions]


class GoalForest:
    """All goals of a run, with what skillers said.

    :param run: read once, here.
    """

    def __init__(self, run: Run) -> None:
        self.goals: dict[GoalKey, Goal] = {}
        self.skillers = Streams()
        self.count = 0
        for event in run:
            if isinstance(event, GoalTransition):
                self._goal_transition(event)
            elif isinstance(event, PlanActionTransition):
                goal = self._goal((intern(event.env), intern(event.goal)))
                plan = goal.plans.setdefault(intern(event.plan), Sequence())
                state = (intern(event.action_id), intern(event.action), intern(event.state))
                plan.append(state, self.count)
            elif isinstance(event, SkillStatus):
                self.skillers.add(event, self.count)
            else:
                continue
            self.count += 1
        self.roots = self._link()

    def _goal(self, key: GoalKey) -> Goal:
        goal = self.goals.get(key)
        if goal is None:
            goal = self.goals[key] = Goal(key)
        return goal

    def _goal_transition(self, event: GoalTransition) -> None:
        """Take a transition of a goal; one that only changes the parent is none of its own."""
        goal = self._goal((intern(event.env), intern(event.goal)))
        goal.goal_class, goal.sub_type = intern(event.goal_class), intern(event.sub_type)
        goal.parent = None if event.parent == "nil" else (intern(event.env), intern(event.parent))
        state = (intern(event.mode), intern(event.outcome), intern(event.error))
        if goal.own.states[-1:] != [state]:
            goal.own.append(state, self.count)

    def _link(self) -> list[Goal]:
        """Give the goals to their parents; return those without one that the run knows."""
        roots = []
        for goal in self.goals.values():
            parent = self.goals.get(goal.parent) if goal.parent else None
            if parent is None or parent is goal:
                roots.append(goal)
            else:
                parent.children.append(goal)
            self._note_names(goal)
        reached = {goal.key for goal in _downwards(roots)}
        for goal in self.goals.values():
            if goal.key not in reached and goal.parent:
                # a ring of parents, which only a damaged file has: cut it open here
                self.goals[goal.parent].children.remove(goal)
                roots.append(goal)
                reached.update(each.key for each in _downwards([goal]))
        return roots

    def _note_names(self, goal: Goal) -> None:
        """Tell the goals that this one names in its errors."""
        for number, (_, _, error) in enumerate(goal.own.states):
            for word in error.split():
                named = self.goals.get((goal.key[0], word))
                if named is not None:
                    named.named_by.append((goal.kind, number))

    def downwards(self) -> Iterator[Goal]:
        """Yield all goals, parents before their children."""
        return _downwards(self.roots)


def _downwards(roots: Iterable[Goal]) -> Iterator[Goal]:
    """Yield goals and all below them, parents before their children."""
    stack = list(roots)[::-1]
    while stack:
        goal = stack.pop()
        yield goal
        stack.extend(reversed(goal.children))


Signatures: TypeAlias = Mapping[GoalKey, int]
"""A number for each goal: two goals with the same number did the same."""


class Signer:
    """Numbers goals by what they and all goals below them did, over any number of runs.

    :param with_parent: whether the side of the parent's transitions counts too.
    """

    def __init__(self, *, with_parent: bool) -> None:
        self._with_parent = with_parent
        self._numbers: dict[object, int] = {}

    def sign(self, forest: GoalForest) -> Signatures:
        """Return the signature of every goal of a run."""
        signatures: dict[GoalKey, int] = {}
        for goal in reversed(list(forest.downwards())):
            parent = forest.goals.get(goal.parent) if self._with_parent and goal.parent else None
            what = (
                goal.kind,
                tuple((mode, outcome, anonymous(error)) for mode, outcome, error in goal.own.states),
                tuple(parent.before(goal.own)[1:]) if parent else (),
                tuple(sorted(goal.named_by)),
                tuple(
                    (plan_stem(goal, plan), tuple(steps.states), tuple(goal.before(steps)))
                    for plan, steps in goal.plans.items()
                ),
                tuple(sorted(signatures[child.key] for child in goal.children)),
            )
            signatures[goal.key] = self._numbers.setdefault(what, len(self._numbers))
        return signatures


def plan_stem(goal: Goal, plan: str) -> str:
    """Return a plan's id without the id of its goal and without gensym numbers."""
    return anonymous(plan.replace(goal.key[1], "@"))
