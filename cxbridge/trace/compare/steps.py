"""The steps of one goal, plan, skiller or interface in two runs: what differs between them."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.compare.align import NONE, align
from cxbridge.trace.compare.checks import Times, Tolerance
from cxbridge.trace.compare.result import MAX_DIFFERENCES, Comparison, Difference, Kind, Row, Side, ends_early
from cxbridge.trace.compare.trail import Line
from cxbridge.trace.compare.words import time_words

ROWS_AROUND: Final = 8
"""So many steps are shown before and after the first difference."""

State: TypeAlias = tuple[str, ...]
"""What counts of a step."""


@dataclass(slots=True)
class Steps:
    """Steps in order.

    :param states: the states one after the other.
    :param positions: the number of the event of each step among all that are compared, from 0.
    :param times: when each came, microseconds.
    """

    states: list[State] = field(default_factory=list)
    positions: array[int] = field(default_factory=lambda: array("q"))
    times: array[int] = field(default_factory=lambda: array("q"))

    def append(self, state: State, position: int, time_us: int) -> None:
        """Add a step."""
        self.states.append(state)
        self.positions.append(position)
        self.times.append(time_us)


@dataclass(frozen=True, slots=True)
class StepPair:
    """The steps of what is the same in both runs.

    :param subject: what it is.
    :param noun: what a step is called.
    :param states_a: the states with names that are the same for both runs; ``states_b``: likewise.
    """

    subject: str
    noun: str
    a: Steps
    b: Steps
    states_a: list[State]
    states_b: list[State]

    def differences(self, times: Times | None = None) -> Iterator[Difference]:
        """Yield what differs, in the order of the first run."""
        if self.states_a == self.states_b:
            if times:
                partners = array("q", range(len(self.states_a)))
                yield from self._late(partners, times)
            return
        partners = self.partners()
        loose_a = [at for at, partner in enumerate(partners) if partner == NONE]
        taken = set(partners)
        loose_b = [at for at in range(len(self.states_b)) if at not in taken]
        yield from self._moved(loose_a, loose_b)
        paired_a = [at for at, partner in enumerate(partners) if partner != NONE]
        paired_b = [partners[at] for at in paired_a]
        gaps: dict[int, tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
        for at in loose_a:
            gaps[bisect_left(paired_a, at)][0].append(at)
        for at in loose_b:
            gaps[bisect_left(paired_b, at)][1].append(at)
        for before, (ours, theirs) in sorted(gaps.items()):
            last = (paired_a[before - 1], paired_b[before - 1]) if before else (NONE, NONE)
            yield from self._gap(last, ours, theirs)
        if times:
            yield from self._late(partners, times)

    def partners(self) -> array[int]:
        """Return the step of B that each step of A is the same as, -1 for none."""
        numbers: dict[Hashable, int] = {}
        sequences = [
            [numbers.setdefault(state, len(numbers)) for state in states]
            for states in (self.states_a, self.states_b)
        ]
        return align(*sequences)

    def _moved(self, loose_a: list[int], loose_b: list[int]) -> Iterator[Difference]:
        """Yield the steps that both have, at other places, and take them out of the lists."""
        left: dict[State, deque[int]] = defaultdict(deque)
        for at in loose_b:
            left[self.states_b[at]].append(at)
        for at in list(loose_a):
            others = left.get(self.states_a[at])
            if others:
                other = others.popleft()
                loose_a.remove(at)
                loose_b.remove(other)
                what = f"its {self.noun} number {at + 1} is its number {other + 1} in B"
                yield Difference(what, self.subject, self._side_a(at), self._side_b(other), Kind.ORDER)

    def _gap(self, last: tuple[int, int], ours: list[int], theirs: list[int]) -> Iterator[Difference]:
        """Yield what differs after two steps that are the same: changed ones, then those of one run only."""
        for one, other in zip(ours, theirs, strict=False):
            what = f"its {self.noun} number {one + 1}"
            yield Difference(what, self.subject, self._side_a(one), self._side_b(other))
        more_a, more_b = ours[len(theirs) :], theirs[len(ours) :]
        if more_a:
            missing = self._missing(self.b, theirs[-1] if theirs else last[1])
            what = self._numbered(more_a, "A")
            yield Difference(what, self.subject, self._side_a(more_a[0]), missing, Kind.ONLY_A, len(more_a))
        if more_b:
            missing = self._missing(self.a, ours[-1] if ours else last[0])
            what = self._numbered(more_b, "B")
            yield Difference(what, self.subject, missing, self._side_b(more_b[0]), Kind.ONLY_B, len(more_b))

    def _numbered(self, steps: list[int], name: str) -> str:
        """Return in words which steps one run has alone."""
        if len(steps) == 1:
            return f"its {self.noun} number {steps[0] + 1}, which only {name} has"
        return f"its {self.noun}s number {steps[0] + 1} to {steps[-1] + 1}, which only {name} has"

    def _missing(self, steps: Steps, last: int) -> Side:
        """Return what a run has that has no step here, the last one before being its number ``last``."""
        if not steps.states:
            return Side(None, f"(no {self.noun})")
        where = "no further" if last == len(steps.states) - 1 else "no such"
        return Side(steps.positions[last] if last != NONE else None, f"({where} {self.noun})")

    def _late(self, partners: array[int], times: Times) -> Iterator[Difference]:
        """Yield the steps that did not come at the same time."""
        for at, partner in enumerate(partners):
            if partner == NONE:
                continue
            late = times.lag(self.subject, self.a.times[at], self.b.times[partner])
            if late is not None:
                what = f"its {self.noun} number {at + 1}: {time_words(late)}"
                yield Difference(what, self.subject, self._side_a(at), self._side_b(partner), Kind.TIME)

    def _side_a(self, at: int) -> Side:
        return Side(self.a.positions[at], text_of(self.states_a[at]))

    def _side_b(self, at: int) -> Side:
        return Side(self.b.positions[at], text_of(self.states_b[at]))

    def rows(self, begin: tuple[int, int]) -> list[Row]:
        """Return the steps of both runs next to each other, around the first difference.

        :param begin: when each run began, microseconds.
        """
        partners = self.partners()
        rows: list[Row] = []
        next_b = 0
        for at in range(len(self.states_a) + 1):
            partner = partners[at] if at < len(self.states_a) else len(self.states_b)
            one = self._line(0, at, begin) if at < len(self.states_a) else None
            if partner == NONE:
                rows.append(Row(one, None, same=False))
                continue
            rows += [Row(None, self._line(1, other, begin), same=False) for other in range(next_b, partner)]
            next_b = partner + 1
            if one is not None:
                rows.append(Row(one, self._line(1, partner, begin), same=True))
        here = next((number for number, row in enumerate(rows) if not row.same), 0)
        return rows[max(0, here - ROWS_AROUND) : here + ROWS_AROUND]

    def _line(self, run: int, at: int, begin: tuple[int, int]) -> Line:
        """Return a step as a line."""
        steps, states = ((self.a, self.states_a), (self.b, self.states_b))[run]
        seconds = (steps.times[at] - begin[run]) / MICROSECONDS
        return Line(steps.positions[at] + 1, seconds, text_of(states[at]), here=False)


class Differing:
    """Collects the differences between many steps, and knows where the first of them is.

    :param begin: when each run began, microseconds.
    """

    def __init__(self, begin: tuple[int, int], tolerance: Tolerance | None = None) -> None:
        self.found: list[Difference] = []
        self._begin = begin
        self._times = Times(tolerance, begin) if tolerance else None
        self._pairs: dict[str, StepPair] = {}

    def compare(self, pair: StepPair) -> None:
        """Compare the steps of one goal, plan, skiller or interface."""
        differences = list(pair.differences(self._times))
        if differences:
            self.found += differences
            self._pairs[pair.subject] = pair

    def finish(self, comparison: Comparison) -> None:
        """Put what was found into a comparison, sorted by where it comes up."""
        self.found.sort(key=lambda difference: difference.position)
        comparison.differences = self.found[:MAX_DIFFERENCES]
        comparison.dropped = len(self.found) - len(comparison.differences)
        comparison.hints += ends_early(self.found, comparison.count_a, comparison.count_b)
        if self.found and (pair := self._pairs.get(self.found[0].subject)):
            comparison.rows = pair.rows(self._begin)


def text_of(state: State) -> str:
    """Return a state as one line."""
    return " ".join(state).strip()
