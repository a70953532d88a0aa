"""Reads the goals and plans of a run, each with the sequence of its own transitions."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from sys import intern
from typing import Final, TypeAlias

from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.details import DetailNews
from cxbridge.trace.compare.names import anonymous, anonymous_fact
from cxbridge.trace.compare.sequences import State, Steps, Streams

UNKNOWN: Final = "?"
"""Class of a goal of which only plan-actions are known."""

GoalKey: TypeAlias = tuple[str, str]
"""Environment and id of a goal."""


@dataclass(slots=True)
class Goal:
    """A goal and its plans.

    :param parent: the parent it had last, None for none.
    :param plans: by plan id.
    :param details: what it said of its parameters and the like, where that changed.
    :param plan_details: what its plan-actions did, by plan id; each state begins with the action's id.
    :param deeds: what it did, once somebody asked.
    :param named_by: kind of each goal that names this one in an error, and at which of its transitions.
    """

    key: GoalKey
    goal_class: str = UNKNOWN
    sub_type: str = UNKNOWN
    parent: GoalKey | None = None
    own: Steps = field(default_factory=Steps)
    plans: dict[str, Steps] = field(default_factory=dict)
    details: Steps = field(default_factory=Steps)
    plan_details: dict[str, Steps] = field(default_factory=dict)
    children: list[Goal] = field(default_factory=list)
    named_by: list[tuple[tuple[str, ...], int]] = field(default_factory=list)
    deeds: Counter[State] | None = None

    @property
    def kind(self) -> tuple[str, str, str, str]:
        """What tells siblings apart: environment, class, sub-type, and the id without its number."""
        return (self.key[0], self.goal_class, self.sub_type, anonymous(self.key[1]))

    @property
    def start(self) -> int:
        """The position of its first transition."""
        first = [*self.own.positions[:1], *(plan.positions[0] for plan in self.plans.values())]
        return min(first)

    @property
    def size(self) -> int:
        """How many goals there are from here down."""
        return sum(1 for _ in _downwards([self]))

    def likeness(self, other: Goal) -> float:
        """Return which part of what this goal and another did is the same, from 0 to 1, in whatever order."""
        ours, theirs = self._deeds(), other._deeds()
        return 2 * (ours & theirs).total() / max(1, ours.total() + theirs.total())

    def _deeds(self) -> Counter[State]:
        """Return the states of the goal and its plans without names, and the classes of its children."""
        if self.deeds is None:
            self.deeds = Counter((*state[:2], anonymous(state[2])) for state in self.own.states)
            for steps in self.plans.values():
                self.deeds.update(steps.states)
            for steps in (self.details, *self.plan_details.values()):
                self.deeds.update(steps.states)
            self.deeds.update((child.goal_class, child.sub_type) for child in self.children)
        return self.deeds

    def before(self, inner: Steps) -> list[int]:
        """Return, for each transition of a child or plan, how many of this goal's own came before it."""
        return [bisect_left(self.own.positions, position) for position in inner.positions]


class GoalForest:
    """All goals of a run, with what skillers said.

    :param events: those of the run, read once, here.
    """

    def __init__(self, events: Iterable[Event]) -> None:
        self.goals: dict[GoalKey, Goal] = {}
        self.skillers = Streams()
        self.count = 0
        self.start_us = 0
        self._states: dict[State, State] = {}
        self._news = DetailNews()
        for event in events:
            if not self.count:
                self.start_us = event.time_us
            if isinstance(event, GoalTransition):
                self._goal_transition(event)
            elif isinstance(event, PlanActionTransition):
                self._action_transition(event)
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
        goal.goal_class = _joined(goal.goal_class, event.goal_class)
        goal.sub_type = _joined(goal.sub_type, event.sub_type)
        parent = parent_id(event.parent)
        goal.parent = None if parent is None else (intern(event.env), intern(parent))
        state = self._state(event.mode, event.outcome, event.error)
        if goal.own.states[-1:] != [state]:
            goal.own.append(state, self.count, event.time_us)
        self._take_details(goal.details, event, ())

    def _action_transition(self, event: PlanActionTransition) -> None:
        """Take a transition of a plan-action."""
        goal, plan = self._goal((intern(event.env), intern(event.goal))), intern(event.plan)
        state = self._state(event.action_id, event.action, event.state)
        goal.plans.setdefault(plan, Steps()).append(state, self.count, event.time_us)
        details = goal.plan_details.setdefault(plan, Steps())
        self._take_details(details, event, (event.action_id, event.action))

    def _take_details(self, steps: Steps, event: Event, subject: State) -> None:
        """Note the details of an event where they are new."""
        words = [
            f"{name}={anonymous_fact(value)}"
            for name, value in zip(event.KIND.details, self._news.of(event), strict=True)
            if value
        ]
        if words:
            steps.append(self._state(*subject, *words), self.count, event.time_us)

    def _state(self, *parts: str) -> State:
        """Return a state; equal ones are one object, for there are many."""
        return self._states.setdefault(parts, parts)

    def _link(self) -> list[Goal]:
        """Give the goals to their parents; return those without one that the run knows."""
        forest = Forest({key: goal.parent for key, goal in self.goals.items()})
        for key, goal in self.goals.items():
            goal.children = [self.goals[child] for child in forest.children.get(key, ())]
            self._note_names(goal)
        return [self.goals[key] for key in forest.roots]

    def _note_names(self, goal: Goal) -> None:
        """Note at the goals that this one names in its errors that it does."""
        for number, (_, _, error) in enumerate(goal.own.states):
            for word in error.split():
                named = self.goals.get((goal.key[0], word))
                if named is not None:
                    named.named_by.append((goal.kind, number))

    @property
    def scopes(self) -> set[str]:
        """The classes of its goals, and the skills."""
        return {f"goal class {goal.goal_class}" for goal in self.goals.values()} | self.skillers.scopes

    def downwards(self) -> Iterator[Goal]:
        """Yield all goals, parents before their children."""
        return _downwards(self.roots)


def _joined(known: str, new: str) -> str:
    """Return the class of a goal; one that says now this and now that has both."""
    return known if known == new else intern(new if known == UNKNOWN else f"{known}|{new}")


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
                tuple(goal.details.states),
                tuple(tuple(steps.states) for steps in goal.plan_details.values()),
                tuple(sorted(signatures[child.key] for child in goal.children)),
            )
            signatures[goal.key] = self._numbers.setdefault(what, len(self._numbers))
        return signatures


def plan_stem(goal: Goal, plan: str) -> str:
    """Return a plan's id without the id of its goal and without gensym numbers."""
    return anonymous(plan.replace(goal.key[1], "@"))


def plans_by_stem(goal: Goal, of: Mapping[str, Steps] | None = None) -> dict[str, Steps]:
    """Return the plans of a goal by ids that are the same in every run.

    :param of: steps by the plan's id; None: those of the plans.
    """
    plans: dict[str, Steps] = {}
    for plan, steps in (goal.plans if of is None else of).items():
        stem = name = plan_stem(goal, plan)
        number = 1
        while name in plans:
            number += 1
            name = f"{stem}[{number}]"
        plans[name] = steps
    return plans
