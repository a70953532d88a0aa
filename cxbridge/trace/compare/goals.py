"""The goals of a run for a comparison in partial order, with the steps of goals, plans and Skillers."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from sys import intern
from typing import Final, NamedTuple, TypeAlias

from cxbridge.events import Event, GoalTransition
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.names import replace_names
from cxbridge.trace.compare.steps import TYPES_WITH_DETAILS, Key, Step, describe_subject

UNKNOWN_CLASS: Final = "?"
"""The class of a goal of which only plan-actions are known."""


class GoalKey(NamedTuple):
    """The environment and id of a goal."""

    env: str
    id: str


GOAL_ITSELF: Final = ""
"""The key of the transitions of a goal itself, where other steps have their plan."""

Steps: TypeAlias = Sequence[Step]


@dataclass(eq=False, slots=True)
class Goal:
    """A goal and its plans.

    :param threads: the steps by plan, and those of the goal itself by :data:`GOAL_ITSELF`. The plans have
        their recorded ids while the run is read, afterwards ids that are equal in all runs.
    :param details: the changes of details, such as parameters, by plan.
    :param errors: the errors of the transitions as recorded, by the index of the transition.
    :param error_mentions: the kind of each goal whose error names this goal, and the index of the transition.
    """

    key: GoalKey
    goal_class: str = UNKNOWN_CLASS
    sub_type: str = UNKNOWN_CLASS
    parent: GoalKey | None = None
    threads: dict[str, list[Step]] = field(default_factory=lambda: defaultdict(list))
    details: dict[str, list[Step]] = field(default_factory=lambda: defaultdict(list))
    children: list[Goal] = field(default_factory=list)
    errors: dict[int, str] = field(default_factory=dict)
    error_mentions: list[tuple[tuple[str, ...], int]] = field(default_factory=list)

    @property
    def kind(self) -> tuple[str, str, str, str]:
        """The properties that distinguish siblings: environment, class, sub-type, and id without number."""
        return (self.key.env, self.goal_class, self.sub_type, replace_names(self.key.id))

    @property
    def transitions(self) -> Steps:
        """The transitions of the goal itself."""
        return self.threads.get(GOAL_ITSELF, ())

    @property
    def first_position(self) -> int:
        """The position of the first step of the goal and its plans."""
        return min(steps[0].position for steps in self.threads.values())

    @property
    def goal_count(self) -> int:
        """The number of goals in this subtree, including this goal."""
        return sum(1 for _ in walk_goals([self]))

    def find_keys(self) -> list[tuple[str, tuple[Key, ...]]]:
        """Return the keys of all steps, then those of all details, each with their plan."""
        threads = (*self.threads.items(), *self.details.items())
        return [(plan, tuple(step.key for step in steps)) for plan, steps in threads]

    def counts_before(self, inner_steps: Steps) -> list[int]:
        """Return, for each transition of a child or plan, the number of earlier transitions of this goal."""
        positions = [step.position for step in self.transitions]
        return [bisect_left(positions, step.position) for step in inner_steps]

    def rename_plans(self) -> None:
        """Replace the ids of plans by stems, which are equal in all runs.

        A stem is the plan's id with ``@`` for the goal's id, without gensym numbers. Equal stems are
        numbered, as in ``@-PLAN[2]``.
        """
        counts: Counter[str] = Counter()
        names: dict[str, str] = {}
        for plan in self.threads:
            stem = replace_names(plan.replace(self.key.id, "@"))
            counts[stem] += 1
            names[plan] = f"{stem}[{counts[stem]}]" if counts[stem] > 1 else stem
        self.threads = {names[plan]: steps for plan, steps in self.threads.items()}
        self.details = {names[plan]: steps for plan, steps in self.details.items()}


class GoalForest:
    """All goals of a run, and the streams: the states of Skillers and interfaces without repetitions.

    :param steps: the steps of the run with their events, read once by the constructor.
    :ivar roots: the goals without a known parent.
    :ivar streams: by Skiller or interface.
    """

    def __init__(self, steps: Iterable[tuple[Step, Event]]) -> None:
        self.goals: dict[GoalKey, Goal] = {}
        self.streams: dict[str, list[Step]] = defaultdict(list)
        self._keys: dict[Key, Key] = {}
        for named_step, event in steps:
            # without an order of all events, names cannot be told apart
            step = Step(named_step.key, (), named_step.position, event.time_us)
            if not isinstance(event, TYPES_WITH_DETAILS):
                stream = self.streams[describe_subject(event)]
                # the load of the machine decides how often a writer repeats a value
                if not stream or stream[-1].key != step.key:
                    stream.append(step)
                continue
            goal = self._find_or_add_goal(event.env, event.goal)
            if isinstance(event, GoalTransition):
                plan = GOAL_ITSELF
                self._add_goal_transition(goal, step, event)
            else:
                plan = intern(event.plan)
                goal.threads[plan].append(step)
            if named_step.details:
                goal.details[plan].append(step._replace(key=named_step.details[0]))
        self.roots = self._link_goals()

    def _find_or_add_goal(self, env: str, name: str) -> Goal:
        # each event repeats its ids: long runs fit into memory if each id is stored once
        key = GoalKey(intern(env), intern(name))
        return self.goals.get(key) or self.goals.setdefault(key, Goal(key))

    def _add_goal_transition(self, goal: Goal, step: Step, event: GoalTransition) -> None:
        """Add a transition of a goal, unless mode, outcome and error are those of the transition before."""
        goal.goal_class = _join_classes(goal.goal_class, event.goal_class)
        goal.sub_type = _join_classes(goal.sub_type, event.sub_type)
        parent = parent_id(event.parent)
        goal.parent = None if parent is None else GoalKey(goal.key.env, intern(parent))
        index = len(goal.transitions)
        # class, sub-type and parent are compared once: a tree may be built from its leaves or from its root
        # (docs/evidence/comparing.md), so that a new parent alone is no transition
        key = (*step.key[:3], "", "", "", *step.key[6:])
        key = self._keys.setdefault(key, key)
        step = Step(key, (), step.position, step.time_us)
        if index and goal.transitions[-1].key == key and goal.errors.get(index - 1, "") == event.error:
            return
        goal.threads[GOAL_ITSELF].append(step)
        if event.error:
            goal.errors[index] = event.error

    def _link_goals(self) -> list[Goal]:
        """Complete the goals of the whole run; return those without a known parent.

        The goals get their children, the final ids of their plans and the mentions in errors.
        """
        forest = Forest({key: goal.parent for key, goal in self.goals.items()})
        for key, goal in self.goals.items():
            goal.children = [self.goals[child] for child in forest.children.get(key, ())]
            goal.rename_plans()
            # an error may name one of several siblings that behave equally: the mention tells them apart
            for index, error in goal.errors.items():
                for word in error.split():
                    if mentioned_goal := self.goals.get(GoalKey(key.env, word)):
                        mentioned_goal.error_mentions.append((goal.kind, index))
        return [self.goals[key] for key in forest.roots]


def _join_classes(known_class: str, new_class: str) -> str:
    """Return the class of a goal; different classes of its transitions are joined by ``|``."""
    if new_class == known_class:
        return known_class
    return intern(new_class if known_class == UNKNOWN_CLASS else f"{known_class}|{new_class}")


def walk_goals(roots: Iterable[Goal]) -> Iterator[Goal]:
    """Yield goals and their descendants, parents before their children."""
    stack = list(roots)[::-1]
    while stack:
        goal = stack.pop()
        yield goal
        stack.extend(reversed(goal.children))


def goal_signatures(forest: GoalForest, numbers: dict[object, int], *, with_parent: bool) -> dict[Goal, int]:
    """Return a number per goal, equal for goals whose subtrees behaved equally.

    :param numbers: the assigned numbers by behaviour, which the function completes; the same for all runs.
    :param with_parent: whether the position among the parent's transitions belongs to the behaviour.
    """
    signatures: dict[Goal, int] = {}
    # children before their parents, whose signature contains theirs
    for goal in reversed(list(walk_goals(forest.roots))):
        parent = forest.goals.get(goal.parent) if with_parent and goal.parent else None
        # the position of the first transition does not count, because a child may be formulated before its
        # parent, depending on how the rules build the tree
        behaviour = (
            goal.kind,
            tuple(parent.counts_before(goal.transitions)[1:]) if parent else (),
            tuple(sorted(goal.error_mentions)),
            tuple(goal.find_keys()),
            tuple(tuple(goal.counts_before(steps)) for steps in goal.threads.values()),
            tuple(sorted(signatures[child] for child in goal.children)),
        )
        signatures[goal] = numbers.setdefault(behaviour, len(numbers))
    return signatures
