"""Reading of a run's goals and plans, with their sequences of transitions."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from sys import intern
from typing import Final, TypeAlias

from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.details import DetailChanges, MissingDetails
from cxbridge.trace.compare.names import anonymous, anonymous_fact
from cxbridge.trace.compare.sequences import State, Step, Steps, Streams, states_of

UNKNOWN: Final = "?"
"""The class of a goal of which only plan-actions are known."""

GoalKey: TypeAlias = tuple[str, str]
"""The environment and id of a goal."""


@dataclass(eq=False, slots=True)
class Goal:
    """A goal and its plans.

    :param own: its transitions, without those that change only the parent.
    :param plans: the transitions of its plan-actions, by plan id; after reading, by ids that are equal in all
        runs.
    :param details: its parameters and other details, when they changed.
    :param plan_details: the details of its plan-actions by plan; each state starts with the action's id.
    :param deeds: the states of the goal and its plans, computed for comparisons with other goals.
    :param named_by: the kind of each goal whose error names this one, and the index of the transition.
    """

    key: GoalKey
    goal_class: str = UNKNOWN
    sub_type: str = UNKNOWN
    parent: GoalKey | None = None
    own: list[Step] = field(default_factory=list)
    plans: dict[str, list[Step]] = field(default_factory=dict)
    details: list[Step] = field(default_factory=list)
    plan_details: dict[str, list[Step]] = field(default_factory=dict)
    children: list[Goal] = field(default_factory=list)
    named_by: list[tuple[tuple[str, ...], int]] = field(default_factory=list)
    deeds: Counter[State] = field(default_factory=Counter)

    @property
    def kind(self) -> tuple[str, str, str, str]:
        """The properties that distinguish siblings: environment, class, sub-type, and id without number."""
        return (self.key[0], self.goal_class, self.sub_type, anonymous(self.key[1]))

    @property
    def start(self) -> int:
        """The position of the first transition."""
        return min(steps[0].position for steps in (self.own, *self.plans.values()) if steps)

    @property
    def size(self) -> int:
        """The number of goals in this subtree."""
        return sum(1 for _ in downwards([self]))

    def likeness(self, other: Goal) -> float:
        """Return the share of equal states of two goals, in any order, from 0 to 1."""
        ours, theirs = self._known_deeds(), other._known_deeds()
        return 2 * (ours & theirs).total() / max(1, ours.total() + theirs.total())

    def _known_deeds(self) -> Counter[State]:
        """Return the states of goal and plans without names, and the classes of the children."""
        if not self.deeds:
            self.deeds.update((*step.state[:2], anonymous(step.state[2])) for step in self.own)
            for steps in (*self.plans.values(), self.details, *self.plan_details.values()):
                self.deeds.update(states_of(steps))
            self.deeds.update((child.goal_class, child.sub_type) for child in self.children)
        return self.deeds

    def before(self, inner: Steps) -> list[int]:
        """Return, for each transition of a child or plan, the number of this goal's earlier ones."""
        positions = [step.position for step in self.own]
        return [bisect_left(positions, step.position) for step in inner]

    def by_stem(self, steps: Mapping[str, list[Step]]) -> dict[str, list[Step]]:
        """Return steps of plans by ids without gensym numbers.

        :param steps: by plan id.
        """
        found: dict[str, list[Step]] = {}
        counts: Counter[str] = Counter()
        for plan, each in steps.items():
            stem = anonymous(plan.replace(self.key[1], "@"))
            counts[stem] += 1
            found[stem if counts[stem] == 1 else f"{stem}[{counts[stem]}]"] = each
        return found


class GoalForest:
    """All goals of a run, and the statuses of its Skillers.

    :param events: read once, by the constructor.
    :param missing: details that do not count.
    """

    def __init__(self, events: Iterable[Event], missing: MissingDetails | None = None) -> None:
        self.goals: dict[GoalKey, Goal] = {}
        self.skillers = Streams()
        self.count = 0
        self.start_us = 0
        self._detail_changes = DetailChanges(missing)
        for event in events:
            self.start_us = event.time_us if not self.count else self.start_us
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

    @property
    def scopes(self) -> set[str]:
        """The classes of the goals, and the skills."""
        return {f"goal class {goal.goal_class}" for goal in self.goals.values()} | self.skillers.scopes

    def _goal(self, env: str, name: str) -> Goal:
        key = (intern(env), intern(name))
        return self.goals.get(key) or self.goals.setdefault(key, Goal(key))

    def _goal_transition(self, event: GoalTransition) -> None:
        """Process a transition of a goal; one that changes only the parent is ignored."""
        goal = self._goal(event.env, event.goal)
        goal.goal_class = _joined(goal.goal_class, event.goal_class)
        goal.sub_type = _joined(goal.sub_type, event.sub_type)
        parent = parent_id(event.parent)
        goal.parent = None if parent is None else (goal.key[0], intern(parent))
        state = (event.mode, event.outcome, event.error)
        if not goal.own or goal.own[-1].state != state:
            goal.own.append(Step(state, self.count, event.time_us))
        self._take_details(goal.details, event, ())

    def _action_transition(self, event: PlanActionTransition) -> None:
        goal, plan = self._goal(event.env, event.goal), intern(event.plan)
        state = (event.action_id, event.action, event.state)
        goal.plans.setdefault(plan, []).append(Step(state, self.count, event.time_us))
        self._take_details(goal.plan_details.setdefault(plan, []), event, (event.action_id, event.action))

    def _take_details(self, steps: list[Step], event: Event, subject: State) -> None:
        changes = zip(event.KIND.details, self._detail_changes.of(event), strict=True)
        words = [f"{name}={anonymous_fact(value)}" for name, value in changes if value]
        if words:
            steps.append(Step((*subject, *words), self.count, event.time_us))

    def _link(self) -> list[Goal]:
        """Link goals to their parents; return those without a known parent."""
        forest = Forest({key: goal.parent for key, goal in self.goals.items()})
        for key, goal in self.goals.items():
            goal.children = [self.goals[child] for child in forest.children.get(key, ())]
            goal.plans, goal.plan_details = goal.by_stem(goal.plans), goal.by_stem(goal.plan_details)
            for number, step in enumerate(goal.own):
                for word in step.state[2].split():
                    if named := self.goals.get((key[0], word)):
                        named.named_by.append((goal.kind, number))
        return [self.goals[key] for key in forest.roots]


def _joined(known: str, new: str) -> str:
    """Return the class of a goal; different classes are joined."""
    return known if known == new else intern(new if known == UNKNOWN else f"{known}|{new}")


def downwards(roots: Iterable[Goal]) -> Iterator[Goal]:
    """Yield goals and their descendants, parents before their children."""
    stack = list(roots)[::-1]
    while stack:
        goal = stack.pop()
        yield goal
        stack.extend(reversed(goal.children))


def sign(forest: GoalForest, numbers: dict[object, int], *, with_parent: bool) -> dict[Goal, int]:
    """Return a number per goal, equal for goals whose subtrees behaved equally.

    :param numbers: the numbers assigned so far, for any number of runs.
    :param with_parent: include the position among the parent's transitions.
    """
    signed: dict[Goal, int] = {}
    for goal in reversed(list(downwards(forest.roots))):
        parent = forest.goals.get(goal.parent) if with_parent and goal.parent else None
        deeds = (
            goal.kind,
            tuple((*step.state[:2], anonymous(step.state[2])) for step in goal.own),
            tuple(parent.before(goal.own)[1:]) if parent else (),
            tuple(sorted(goal.named_by)),
            tuple((plan, states_of(steps), tuple(goal.before(steps))) for plan, steps in goal.plans.items()),
            states_of(goal.details),
            tuple(states_of(steps) for steps in goal.plan_details.values()),
            tuple(sorted(signed[child] for child in goal.children)),
        )
        signed[goal] = numbers.setdefault(deeds, len(numbers))
    return signed
