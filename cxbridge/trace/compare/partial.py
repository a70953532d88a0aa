"""Partial order of transitions: what depends on what must be in the same order, nothing else.

docs/trace-model.md, section "Partial order", is the definition that this module implements.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cxbridge.trace.compare.goals import Goal, GoalForest, GoalKey, State, plan_stem
from cxbridge.trace.compare.goals import Sequence as Steps
from cxbridge.trace.compare.matching import Match, match_goals
from cxbridge.trace.compare.naming import anonymous
from cxbridge.trace.compare.result import Comparison, Difference, Order, Side
from cxbridge.trace.formats.base import Run
from cxbridge.trace.levels import View


def compare_partial(a: Run, others: Sequence[Run]) -> Comparison:
    """Compare the transitions of a run with those of others.

    With several others, the run must have the same goals, plans, statuses as each of them; of the relations
    between a goal and its parent only those count that all the others agree on.
    """
    forest_a = GoalForest(a)
    agreed: dict[_Place, _Agreed] = {}
    count_b = 0
    for number, run in enumerate(others):
        forest_b = GoalForest(run)
        match = match_goals(forest_a, forest_b)
        differences = list(_sequence_differences(match))
        differences += forest_a.skillers.differences(forest_b.skillers)
        if differences:
            return _comparison(forest_a.count, forest_b.count, differences, number)
        _agree(agreed, match)
        count_b = count_b or forest_b.count
    differences = [_side_difference(relation) for relation in agreed.values() if not relation.holds]
    return _comparison(forest_a.count, count_b, differences, 0)


def _comparison(count_a: int, count_b: int, differences: list[Difference], number: int) -> Comparison:
    """Return the outcome with the differences in the order in which they come up."""
    differences.sort(key=lambda difference: difference.position)
    return Comparison(View.TRANSITIONS, Order.PARTIAL, count_a, count_b, differences, number)


def _sequence_differences(match: Match) -> Iterator[Difference]:
    """Yield the first difference of each goal and each plan."""
    for goal in match.only_a:
        there = Side(goal.start, f"goal {goal.key[1]} of class {goal.goal_class}")
        yield Difference(
            "a goal that only A has", match.labels_a[goal.key], there, Side(None, "(no such goal)")
        )
    for goal in match.only_b:
        there = Side(goal.start, f"goal {goal.key[1]} of class {goal.goal_class}")
        yield Difference(
            "a goal that only B has", match.labels_b[goal.key], Side(None, "(no such goal)"), there
        )
    for one, other in match.pairs:
        label = match.labels_a[one.key]
        own_a, own_b = _renamed(one, match.labels_a), _renamed(other, match.labels_b)
        yield from _first(f"goal {label}", own_a, one.own, own_b, other.own)
        plans_a, plans_b = _plans(one), _plans(other)
        for plan in {**plans_a, **plans_b}:
            steps_a, steps_b = plans_a.get(plan, Steps()), plans_b.get(plan, Steps())
            subject = f"plan {plan.replace('@', one.key[1])} of goal {label}"
            yield from _first(subject, steps_a.states, steps_a, steps_b.states, steps_b)


def _first(
    subject: str, states_a: list[State], steps_a: Steps, states_b: list[State], steps_b: Steps
) -> Iterator[Difference]:
    """Yield the first difference between two sequences, if there is one."""
    for at in range(max(len(states_a), len(states_b))):
        if states_a[at : at + 1] != states_b[at : at + 1]:
            what = f"its transition number {at + 1}"
            yield Difference(what, subject, _side(states_a, steps_a, at), _side(states_b, steps_b, at))
            return


def _side(states: list[State], steps: Steps, at: int) -> Side:
    """Return what one run has at this place of a sequence."""
    if at < len(states):
        return Side(steps.positions[at], " ".join(states[at]).strip())
    if states:
        return Side(steps.positions[-1], "(no further transition)")
    return Side(None, "(no transition)")


def _renamed(goal: Goal, labels: dict[GoalKey, str]) -> list[State]:
    """Return the states of a goal with the goals in its errors called by their labels."""
    env = goal.key[0]
    return [
        (
            mode,
            outcome,
            error and " ".join(labels.get((env, word)) or anonymous(word) for word in error.split()),
        )
        for mode, outcome, error in goal.own.states
    ]


def _plans(goal: Goal) -> dict[str, Steps]:
    """Return the plans of a goal by ids that are the same in every run."""
    plans: dict[str, Steps] = {}
    for plan, steps in goal.plans.items():
        stem = name = plan_stem(goal, plan)
        number = 1
        while name in plans:
            number += 1
            name = f"{stem}[{number}]"
        plans[name] = steps
    return plans


_Place = tuple[GoalKey, str, int]
"""A transition of the first run: its goal, its plan (empty: the goal's own), its number there."""


@dataclass(slots=True)
class _Agreed:
    """How many transitions of its goal or parent goal came before a transition.

    :param outer: the goal whose transitions are counted, in the first run.
    :param low: the fewest among the other runs; :param high: the most.
    """

    subject: str
    outer: Goal
    inner: Steps
    at: int
    ours: int
    low: int
    high: int
    position_b: int

    @property
    def holds(self) -> bool:
        """Whether the first run has every relation that the others agree on."""
        return self.low <= self.ours <= self.high


def _agree(agreed: dict[_Place, _Agreed], match: Match) -> None:
    """Take the relations of one more run."""
    partners = {one.key: other for one, other in match.pairs}
    parents_b = {child.key: goal for _, goal in match.pairs for child in goal.children}
    for parent, _ in match.pairs:
        for one in parent.children:
            other = partners[one.key]
            subject = f"goal {match.labels_a[one.key]}"
            _relate(agreed, (one.key, ""), subject, (parent, one.own), (parents_b[other.key], other.own))
    for one, other in match.pairs:
        plans_b = _plans(other)
        for plan, steps in _plans(one).items():
            subject = f"plan {plan.replace('@', one.key[1])} of goal {match.labels_a[one.key]}"
            _relate(agreed, (one.key, plan), subject, (one, steps), (other, plans_b[plan]))


def _relate(
    agreed: dict[_Place, _Agreed],
    place: tuple[GoalKey, str],
    subject: str,
    ours: tuple[Goal, Steps],
    theirs: tuple[Goal, Steps],
) -> None:
    """Take the relations between the transitions of a goal and those of a child or plan."""
    counts = zip(ours[0].before(ours[1]), theirs[0].before(theirs[1]), strict=True)
    for at, (count_a, count_b) in enumerate(counts):
        if at == 0 and not place[1]:
            # who of parent and child is formulated first is up to how the tree is built
            count_a, count_b = max(count_a, 1), max(count_b, 1)  # noqa: PLW2901
        relation = agreed.get((*place, at))
        if relation is None:
            relation = _Agreed(
                subject, ours[0], ours[1], at, count_a, count_b, count_b, theirs[1].positions[at]
            )
            agreed[(*place, at)] = relation
        relation.low, relation.high = min(relation.low, count_b), max(relation.high, count_b)


def _side_difference(relation: _Agreed) -> Difference:
    """Return the difference that a broken relation is."""
    state = " ".join(relation.inner.states[relation.at]).strip()
    wanted = relation.low if relation.ours < relation.low else relation.high
    return Difference(
        what=f"'{state}' on the other side of transitions of goal {relation.outer.key[1]}",
        subject=relation.subject,
        a=Side(relation.inner.positions[relation.at], _after(relation.outer, relation.ours)),
        b=Side(relation.position_b, _after(relation.outer, wanted)),
    )


def _after(goal: Goal, count: int) -> str:
    """Return in words where a transition is among those of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{' '.join(goal.own.states[count - 1]).strip()}'"
