"""The goals of a run for a comparison in partial order, with their transitions, plans and children."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from sys import intern
from typing import Final, NamedTuple

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.details import DetailChanges, MissingDetails
from cxbridge.trace.compare.names import replace_fact_names, replace_names
from cxbridge.trace.compare.sequences import State, Step, Steps, ValueStreams, step_states

UNKNOWN_CLASS: Final = "?"
"""The class of a goal of which only plan-actions are known."""


class GoalKey(NamedTuple):
    """The environment and id of a goal."""

    env: str
    id: str


class Thread(NamedTuple):
    """The steps of a goal, or of the actions of one of its plans, which are compared in order.

    :param plan: the id of the plan while the run is read, afterwards an id that is equal in all runs; empty
        for the goal itself.
    :param has_details: whether the steps are changes of parameters and other details, each after the id and
        name of its action; otherwise the steps are transitions.
    """

    plan: str = ""
    has_details: bool = False


GOAL_TRANSITIONS: Final = Thread()
"""The thread of the transitions of the goal itself."""


@dataclass(eq=False, slots=True)
class Goal:
    """A goal and its plans.

    :param threads: the steps of the goal and its plans, without transitions that change only the parent.
    :param error_mentions: the kind of each goal whose error names this goal, and the index of the transition.
    """

    key: GoalKey
    goal_class: str = UNKNOWN_CLASS
    sub_type: str = UNKNOWN_CLASS
    parent: GoalKey | None = None
    threads: dict[Thread, list[Step]] = field(default_factory=dict)
    children: list[Goal] = field(default_factory=list)
    error_mentions: list[tuple[tuple[str, ...], int]] = field(default_factory=list)

    @property
    def kind(self) -> tuple[str, str, str, str]:
        """The properties that distinguish siblings: environment, class, sub-type, and id without number."""
        return (self.key.env, self.goal_class, self.sub_type, replace_names(self.key.id))

    @property
    def transitions(self) -> Steps:
        """The transitions of the goal itself."""
        return self.threads.get(GOAL_TRANSITIONS, ())

    @property
    def first_position(self) -> int:
        """The position of the first transition."""
        return min(steps[0].position for steps in self.threads.values())

    @property
    def goal_count(self) -> int:
        """The number of goals in this subtree."""
        return sum(1 for _ in walk_goals([self]))

    def find_states(self) -> dict[Thread, tuple[State, ...]]:
        """Return the states of the threads, without names in errors."""
        states = {thread: step_states(steps) for thread, steps in self.threads.items()}
        return states | {
            GOAL_TRANSITIONS: tuple(
                (mode, outcome, replace_names(error)) for (mode, outcome, error), *_ in self.transitions
            )
        }

    def counts_before(self, inner_steps: Steps) -> list[int]:
        """Return, for each transition of a child or plan, the number of earlier transitions of this goal."""
        positions = [step.position for step in self.transitions]
        return [bisect_left(positions, step.position) for step in inner_steps]

    def rename_plans(self) -> None:
        """Replace the ids of plans by stems, which are equal in all runs.

        A stem is the plan's id with ``@`` for the goal's id, without gensym numbers. Equal stems are
        numbered, as in ``@-PLAN[2]``.
        """
        threads, self.threads = self.threads, {}
        counts: Counter[Thread] = Counter()
        for thread, steps in threads.items():
            stem = replace_names(thread.plan.replace(self.key.id, "@"))
            stem_thread = thread._replace(plan=stem)
            counts[stem_thread] += 1
            number = f"[{counts[stem_thread]}]" if counts[stem_thread] > 1 else ""
            self.threads[stem_thread._replace(plan=f"{stem}{number}")] = steps


class GoalForest:
    """All goals of a run, and the statuses of its Skillers.

    :param events: the transitions of the run, read once by the constructor.
    :param missing_details: details that are not compared.
    :ivar count: the number of compared events.
    :ivar roots: the goals without a known parent.
    """

    def __init__(self, events: Iterable[Event], missing_details: MissingDetails | None = None) -> None:
        self.goals: dict[GoalKey, Goal] = {}
        self.skillers = ValueStreams()
        self.count = 0
        self._detail_changes = DetailChanges(missing_details)
        for event in events:
            if isinstance(event, GoalTransition):
                self._add_goal_transition(event)
            elif isinstance(event, PlanActionTransition):
                action = (event.action_id, event.action)
                goal = self._find_or_add_goal(event.env, event.goal)
                self._add_step(goal, Thread(intern(event.plan)), (*action, event.state), event)
                self._add_details(goal, event.plan, event, action)
            else:
                self.skillers.add(event, self.count)
            self.count += 1
        self.roots = self._link_goals()

    def _find_or_add_goal(self, env: str, name: str) -> Goal:
        # each event repeats its ids: long runs fit into memory if each id is stored once
        key = GoalKey(intern(env), intern(name))
        return self.goals.get(key) or self.goals.setdefault(key, Goal(key))

    def _add_goal_transition(self, event: GoalTransition) -> None:
        """Add a transition of a goal, unless the transition changes only the parent."""
        goal = self._find_or_add_goal(event.env, event.goal)
        goal.goal_class = _join_classes(goal.goal_class, event.goal_class)
        goal.sub_type = _join_classes(goal.sub_type, event.sub_type)
        parent = parent_id(event.parent)
        goal.parent = None if parent is None else GoalKey(goal.key.env, intern(parent))
        state = (event.mode, event.outcome, event.error)
        # a tree may be built from its leaves or from its root (docs/evidence/comparing.md): a new parent
        # alone is no transition
        if not goal.transitions or goal.transitions[-1].state != state:
            self._add_step(goal, GOAL_TRANSITIONS, state, event)
        self._add_details(goal, "", event, ("", ""))

    def _add_step(self, goal: Goal, thread: Thread, state: State, event: Event) -> None:
        goal.threads.setdefault(thread, []).append(Step(state, self.count, event.time_us))

    def _add_details(self, goal: Goal, plan: str, event: Event, action: State) -> None:
        """Add the changed details of an event.

        :param action: the id and name of the action, which are empty for the goal itself.
        """
        changes = zip(event.KIND.detail_fields, self._detail_changes.find_changed_details(event), strict=True)
        details = [f"{name}={replace_fact_names(value)}" for name, value in changes if value]
        if details:
            self._add_step(goal, Thread(intern(plan), has_details=True), (*action, *details), event)

    def _link_goals(self) -> list[Goal]:
        """Link goals to their parents; return those without a known parent."""
        forest = Forest({key: goal.parent for key, goal in self.goals.items()})
        for key, goal in self.goals.items():
            goal.children = [self.goals[child] for child in forest.children.get(key, ())]
            goal.rename_plans()
            # an error may name one of several siblings that behave equally: the mention tells them apart
            for number, ((_mode, _outcome, error), *_) in enumerate(goal.transitions):
                for word in error.split():
                    if mentioned_goal := self.goals.get(GoalKey(key.env, word)):
                        mentioned_goal.error_mentions.append((goal.kind, number))
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

    :param numbers: the numbers assigned so far, for any number of runs.
    :param with_parent: include the position among the parent's transitions.
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
            tuple(goal.find_states().items()),
            tuple(
                tuple(goal.counts_before(steps))
                for thread, steps in goal.threads.items()
                if not thread.has_details
            ),
            tuple(sorted(signatures[child] for child in goal.children)),
        )
        signatures[goal] = numbers.setdefault(behaviour, len(numbers))
    return signatures
