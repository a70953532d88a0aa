"""Partial order between a goal and its children and plans: what came before which of its transitions."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from cxbridge.trace.compare.goals import Goal, GoalKey, plans_by_stem
from cxbridge.trace.compare.matching import Match
from cxbridge.trace.compare.result import Difference, Kind, Side
from cxbridge.trace.compare.steps import Steps, text_of

Place: TypeAlias = tuple[GoalKey, str]
"""A goal of the first run and its plan; empty: the goal's own transitions."""


@dataclass(slots=True)
class _Agreed:
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
        self._agreed: dict[Place, _Agreed] = {}

    def add(self, match: Match) -> None:
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
        self, place: Place, subject: str, ours: tuple[Goal, Steps], theirs: tuple[Goal, Steps]
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
            self._agreed[place] = _Agreed(
                subject, ours[0], ours[1], counts_a, counts_b, counts_b, theirs[1].positions
            )

    def broken(self) -> Iterator[Difference]:
        """Yield the relations that the first run has not."""
        for agreed in self._agreed.values():
            for at, count in enumerate(agreed.ours):
                if not agreed.low[at] <= count <= agreed.high[at]:
                    yield _difference(agreed, at)


def _difference(agreed: _Agreed, at: int) -> Difference:
    """Return the difference that a broken relation is."""
    state = text_of(agreed.inner.states[at])
    ours = agreed.ours[at]
    wanted = agreed.low[at] if ours < agreed.low[at] else agreed.high[at]
    return Difference(
        what=f"'{state}' on the other side of transitions of goal {agreed.outer.key[1]}",
        subject=agreed.subject,
        a=Side(agreed.inner.positions[at], _after(agreed.outer, ours)),
        b=Side(agreed.positions[at], _after(agreed.outer, wanted)),
        kind=Kind.ORDER,
    )


def _after(goal: Goal, count: int) -> str:
    """Return in words where a transition is among those of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{text_of(goal.own.states[count - 1])}'"
