"""Compares in partial order: what depends on what must be in the same order, nothing else.

docs/comparing.md, section "Partial order", is the definition that this module implements.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.goal_matching import GoalMatch, match_goals
from cxbridge.trace.compare.goals import Goal, GoalForest, GoalKey, plans_by_stem
from cxbridge.trace.compare.keys import scenario_hints
from cxbridge.trace.compare.model import Comparison, Difference, DifferenceKind, Order, Side
from cxbridge.trace.compare.names import anonymous, anonymous_fact
from cxbridge.trace.compare.sequences import State, StepDifferences, StepPair, Steps, text_of

PlanKey: TypeAlias = tuple[GoalKey, str]
"""A goal of the first run and its plan; empty: the goal's own transitions."""


def compare_partial(
    a: Iterable[Event], others: Sequence[Iterable[Event]], tolerance: Tolerance | None = None
) -> Comparison:
    """Compare the transitions of a run with those of others, each read once.

    With several others, the run must have the same goals, plans, statuses as each of them; of the relations
    between a goal and its parent only those count that all the others agree on.
    """
    forest_a = GoalForest(a)
    relations = Relations(several=len(others) > 1)
    for number, run in enumerate(others):
        forest_b = GoalForest(run)
        comparison = Comparison(View.TRANSITIONS, Order.PARTIAL, forest_a.count, forest_b.count, other=number)
        match = match_goals(forest_a, forest_b)
        differing = StepDifferences((forest_a.start_us, forest_b.start_us), tolerance)
        differing.found += _goal_differences(match)
        for pair in (*_step_pairs(match), *forest_a.skillers.pairs(forest_b.skillers)):
            differing.compare(pair)
        if differing.found:
            differing.finish(comparison)
            comparison.hints += scenario_hints(forest_a.scopes, forest_b.scopes)
            return comparison
        relations.add(match)
    comparison.other = 0
    comparison.keep(sorted(relations.broken(), key=lambda difference: difference.position))
    return comparison


def _goal_differences(match: GoalMatch) -> Iterator[Difference]:
    """Yield the goals that are in one run only, or have another parent or class."""
    missing = Side(None, "(no such goal)")
    for goal in match.only_a:
        subject, there = match.labels_a[goal.key], Side(goal.start, _goal_text(goal))
        yield Difference("a goal that only A has", subject, there, missing, DifferenceKind.ONLY_A)
    for goal in match.only_b:
        subject, there = match.labels_b[goal.key], Side(goal.start, _goal_text(goal))
        yield Difference("a goal that only B has", subject, missing, there, DifferenceKind.ONLY_B)
    for one, other in match.adopted:
        yield _goal_difference("another parent", match, one, other, [_below(goal) for goal in (one, other)])
    for one, other in match.renamed:
        yield _goal_difference(
            "another class or id", match, one, other, [_named(goal) for goal in (one, other)]
        )


def _goal_difference(what: str, match: GoalMatch, one: Goal, other: Goal, texts: Sequence[str]) -> Difference:
    """Return a difference between goals that belong together."""
    subject = f"goal {match.labels_a[one.key]}"
    return Difference(what, subject, Side(one.start, texts[0]), Side(other.start, texts[1]))


def _below(goal: Goal) -> str:
    """Return which parent a goal has."""
    return f"goal {goal.key[1]} below {goal.parent[1] if goal.parent else 'no parent'}"


def _named(goal: Goal) -> str:
    """Return what a goal is."""
    return f"goal {goal.key[1]} of class {goal.goal_class}, sub-type {goal.sub_type}"


def _goal_text(goal: Goal) -> str:
    """Return what a goal is that one run has only."""
    below = goal.size - 1
    more = f", with {below} below it" if below else ""
    return f"goal {goal.key[1]} of class {goal.goal_class}{more}"


def _step_pairs(match: GoalMatch) -> Iterator[StepPair]:
    """Yield the transitions of all goals and plans, those of partners together."""
    for one, other in match.pairs:
        label = match.labels_a[one.key]
        own_a, own_b = _renamed(one, match.labels_a), _renamed(other, match.labels_b)
        yield StepPair(f"goal {label}", "transition", one.own, other.own, own_a, own_b)
        plans_a, plans_b = plans_by_stem(one), plans_by_stem(other)
        for plan in {**plans_a, **plans_b}:
            steps_a, steps_b = plans_a.get(plan, Steps()), plans_b.get(plan, Steps())
            subject = f"plan {plan.replace('@', one.key[1])} of goal {label}"
            yield StepPair(subject, "transition", steps_a, steps_b, steps_a.states, steps_b.states)
        yield from _detail_pairs(one, other, label)


def _detail_pairs(one: Goal, other: Goal, label: str) -> Iterator[StepPair]:
    """Yield what partners said of their parameters and the like, and their plan-actions of theirs."""
    pairs = [(f"goal {label}", one.details, other.details)]
    details_b = plans_by_stem(other, other.plan_details)
    for plan, steps in plans_by_stem(one, one.plan_details).items():
        if plan in details_b:  # else all that it did is a difference already
            common = {state[0] for state in steps.states} & {state[0] for state in details_b[plan].states}
            subject = f"plan {plan.replace('@', one.key[1])} of goal {label}"
            pairs.append((subject, steps.only(common), details_b[plan].only(common)))
    for subject, a, b in pairs:
        if a.states and b.states:
            yield StepPair(f"details of {subject}", "value", a, b, a.states, b.states, timed=False)


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


@dataclass(slots=True)
class _AgreedRelation:
    """How many transitions of its goal, or parent goal, came before each transition of a plan or goal.

    :param outer: the goal whose transitions are counted, in the first run; ``inner``: what they are before.
    :param low: the fewest among the other runs; ``high``: the most.
    :param positions: where each transition is in the first of the other runs.
    """

    subject: str
    outer: Goal
    inner: Steps
    ours: array[int]
    low: array[int]
    high: array[int]
    positions: array[int]


class Relations:
    """The relations that all the other runs agree on.

    :param several: whether there are several others; with one, only what is broken is remembered.
    """

    def __init__(self, *, several: bool) -> None:
        self._several = several
        self._agreed: dict[PlanKey, _AgreedRelation] = {}

    def add(self, match: GoalMatch) -> None:
        """Take the relations of one more run."""
        partners = {one.key: other for one, other in match.pairs}
        for parent, other_parent in match.pairs:
            for one in parent.children:
                other = partners[one.key]
                place, subject = (one.key, ""), f"goal {match.labels_a[one.key]}"
                self._relate(place, subject, (parent, one.own), (other_parent, other.own))
        for one, other in match.pairs:
            plans_b = plans_by_stem(other)
            for plan, steps in plans_by_stem(one).items():
                subject = f"plan {plan.replace('@', one.key[1])} of goal {match.labels_a[one.key]}"
                self._relate((one.key, plan), subject, (one, steps), (other, plans_b[plan]))

    def _relate(
        self, place: PlanKey, subject: str, ours: tuple[Goal, Steps], theirs: tuple[Goal, Steps]
    ) -> None:
        """Take the relations between the transitions of a goal and those of a child or plan."""
        counts_a = array("q", ours[0].before(ours[1]))
        counts_b = array("q", theirs[0].before(theirs[1]))
        if not place[1]:
            # who of parent and child is formulated first is up to how the tree is built
            counts_a[0], counts_b[0] = max(counts_a[0], 1), max(counts_b[0], 1)
        known = self._agreed.get(place)
        if known is not None:
            known.low = array("q", map(min, known.low, counts_b))
            known.high = array("q", map(max, known.high, counts_b))
        elif self._several or counts_a != counts_b:
            self._agreed[place] = _AgreedRelation(
                subject, ours[0], ours[1], counts_a, counts_b, counts_b, theirs[1].positions
            )

    def broken(self) -> Iterator[Difference]:
        """Yield the relations that the first run has not."""
        for agreed in self._agreed.values():
            for at, count in enumerate(agreed.ours):
                if not agreed.low[at] <= count <= agreed.high[at]:
                    yield _relation_difference(agreed, at)


def _relation_difference(agreed: _AgreedRelation, at: int) -> Difference:
    """Return the difference that a broken relation is."""
    state = text_of(agreed.inner.states[at])
    ours = agreed.ours[at]
    wanted = agreed.low[at] if ours < agreed.low[at] else agreed.high[at]
    return Difference(
        what=f"'{state}' on the other side of transitions of goal {agreed.outer.key[1]}",
        subject=agreed.subject,
        a=Side(agreed.inner.positions[at], _after(agreed.outer, ours)),
        b=Side(agreed.positions[at], _after(agreed.outer, wanted)),
        kind=DifferenceKind.ORDER,
    )


def _after(goal: Goal, count: int) -> str:
    """Return in words where a transition is among those of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{text_of(goal.own.states[count - 1])}'"


def compare_counts(a: Iterable[Event], b: Iterable[Event], view: View) -> Comparison:
    """Compare how often each rule fired, or each fact was asserted and retracted.

    No goal says what depends on what among firings and facts, so the order of these does not count.
    """
    seen_a, seen_b = _EventCounts(a), _EventCounts(b)
    found = []
    for text in {**seen_a.counts, **seen_b.counts}:
        count_a, count_b = seen_a.counts[text], seen_b.counts[text]
        if count_a != count_b:
            found.append(
                Difference(
                    what="another number of times",
                    subject=text,
                    a=Side(seen_a.last.get(text), f"{count_a} times"),
                    b=Side(seen_b.last.get(text), f"{count_b} times"),
                    kind=DifferenceKind.COUNT,
                    count=abs(count_a - count_b),
                )
            )
    comparison = Comparison(view, Order.PARTIAL, seen_a.counts.total(), seen_b.counts.total())
    comparison.keep(sorted(found, key=lambda difference: difference.position))
    comparison.hints = scenario_hints(seen_a.scopes, seen_b.scopes)
    return comparison


class _EventCounts:
    """How often each firing or change of a fact came, and where it came last."""

    def __init__(self, events: Iterable[Event]) -> None:
        self.counts: Counter[str] = Counter()
        self.last: dict[str, int] = {}
        self.scopes: set[str] = set()
        for number, event in enumerate(events):
            if isinstance(event, RuleFired):
                text = f"{event.env}: {event.rule}"
                self.scopes.add(f"rule {event.rule}")
            elif isinstance(event, FactChange):
                arrow = "==>" if event.asserted else "<=="
                text = f"{event.env}: {arrow} {anonymous_fact(event.text)}"
                self.scopes.add(f"template {event.template}")
            else:
                continue
            self.counts[text] += 1
            self.last[text] = number
