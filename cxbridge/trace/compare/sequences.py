"""Compares sequences of steps: those of a goal, plan, skiller or interface in two runs."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Container, Hashable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.trace.compare.align import NONE, align
from cxbridge.trace.compare.checks import PartnerTimes, Tolerance, time_words
from cxbridge.trace.compare.keys import SkillerBacklog, scenario_hints, skill_scope
from cxbridge.trace.compare.model import (
    AlignedRow,
    Comparison,
    Difference,
    DifferenceKind,
    EventLine,
    Order,
    Side,
    ends_early,
)
from cxbridge.trace.compare.names import anonymous, anonymous_fact, interface_text

ROWS_AROUND: Final = 8
"""So many steps are shown before and after the first difference."""

State: TypeAlias = tuple[str, ...]
"""What counts of a step."""


@dataclass(slots=True)
class Steps:
    """The steps of one goal, plan, skiller or interface in order.

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

    def only(self, firsts: Container[str]) -> Steps:
        """Return the steps whose states begin with one of these."""
        kept = Steps()
        for state, position, time_us in zip(self.states, self.positions, self.times, strict=True):
            if state[0] in firsts:
                kept.append(state, position, time_us)
        return kept


@dataclass(frozen=True, slots=True)
class StepPair:
    """The steps of what is the same in both runs.

    :param subject: what it is.
    :param noun: what a step is called.
    :param states_a: the states with names that are the same for both runs; ``states_b``: likewise.
    :param timed: whether their times count; else other steps have these times too.
    """

    subject: str
    noun: str
    a: Steps
    b: Steps
    states_a: list[State]
    states_b: list[State]
    timed: bool = True

    def differences(self, times: PartnerTimes | None = None) -> Iterator[Difference]:
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
                yield self._difference(what, at, other, DifferenceKind.ORDER)

    def _gap(self, last: tuple[int, int], ours: list[int], theirs: list[int]) -> Iterator[Difference]:
        """Yield what differs after two steps that are the same: changed ones, then those of one run only."""
        for one, other in zip(ours, theirs, strict=False):
            yield self._difference(f"its {self.noun} number {one + 1}", one, other, DifferenceKind.CHANGED)
        if more := ours[len(theirs) :]:
            missing = self._missing(self.b, theirs[-1] if theirs else last[1])
            what, side = self._numbered(more, "A"), self._side(0, more[0])
            yield Difference(what, self.subject, side, missing, DifferenceKind.ONLY_A, len(more))
        if more := theirs[len(ours) :]:
            missing = self._missing(self.a, ours[-1] if ours else last[0])
            what, side = self._numbered(more, "B"), self._side(1, more[0])
            yield Difference(what, self.subject, missing, side, DifferenceKind.ONLY_B, len(more))

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

    def _late(self, partners: array[int], times: PartnerTimes) -> Iterator[Difference]:
        """Yield the steps that did not come at the same time."""
        for at, partner in enumerate(partners):
            if partner == NONE:
                continue
            late = times.lag(self.subject, self.a.times[at], self.b.times[partner])
            if late is not None:
                what = f"its {self.noun} number {at + 1}: {time_words(late)}"
                yield self._difference(what, at, partner, DifferenceKind.TIME)

    def _difference(self, what: str, at: int, other: int, kind: DifferenceKind) -> Difference:
        """Return a difference between a step of A and one of B."""
        return Difference(what, self.subject, self._side(0, at), self._side(1, other), kind)

    def _side(self, run: int, at: int) -> Side:
        """Return a step of a run."""
        steps, states = ((self.a, self.states_a), (self.b, self.states_b))[run]
        return Side(steps.positions[at], text_of(states[at]))

    def rows(self, begin: tuple[int, int]) -> list[AlignedRow]:
        """Return the steps of both runs next to each other, around the first difference.

        :param begin: when each run began, microseconds.
        """
        partners = self.partners()
        rows: list[AlignedRow] = []
        next_b = 0
        for at in range(len(self.states_a) + 1):
            partner = partners[at] if at < len(self.states_a) else len(self.states_b)
            one = self._line(0, at, begin) if at < len(self.states_a) else None
            if partner == NONE:
                rows.append(AlignedRow(one, None, same=False))
                continue
            rows += [
                AlignedRow(None, self._line(1, other, begin), same=False) for other in range(next_b, partner)
            ]
            next_b = partner + 1
            if one is not None:
                rows.append(AlignedRow(one, self._line(1, partner, begin), same=True))
        here = next((number for number, row in enumerate(rows) if not row.same), 0)
        return rows[max(0, here - ROWS_AROUND) : here + ROWS_AROUND]

    def _line(self, run: int, at: int, begin: tuple[int, int]) -> EventLine:
        """Return a step as a line."""
        steps, states = ((self.a, self.states_a), (self.b, self.states_b))[run]
        seconds = (steps.times[at] - begin[run]) / MICROSECONDS
        return EventLine(steps.positions[at] + 1, seconds, text_of(states[at]), here=False)


class StepDifferences:
    """Collects the differences between many steps, and knows where the first of them is.

    :param begin: when each run began, microseconds.
    """

    def __init__(self, begin: tuple[int, int], tolerance: Tolerance | None = None) -> None:
        self.found: list[Difference] = []
        self._begin = begin
        self._times = PartnerTimes(tolerance, begin) if tolerance else None
        self._pairs: dict[str, StepPair] = {}

    def compare(self, pair: StepPair) -> None:
        """Compare the steps of one goal, plan, skiller or interface."""
        differences = list(pair.differences(self._times if pair.timed else None))
        if differences:
            self.found += differences
            self._pairs[pair.subject] = pair

    def finish(self, comparison: Comparison) -> None:
        """Put what was found into a comparison, sorted by where it comes up."""
        self.found.sort(key=lambda difference: difference.position)
        comparison.keep(self.found)
        comparison.hints += ends_early(self.found, comparison.count_a, comparison.count_b)
        if self.found and (pair := self._pairs.get(self.found[0].subject)):
            comparison.rows = pair.rows(self._begin)


def text_of(state: State) -> str:
    """Return a state as one line."""
    return " ".join(state).strip()


def compare_streams(
    a: Iterable[Event], b: Iterable[Event], view: View, tolerance: Tolerance | None = None
) -> Comparison:
    """Compare, for each interface or skiller, the sequence of its values; repetitions do not count.

    :param a: the events of a run that are compared; ``b``: those of the other.
    """
    streams_a, streams_b = _read(a), _read(b)
    comparison = Comparison(view, Order.PARTIAL, streams_a.count, streams_b.count)
    differing = StepDifferences((streams_a.start_us, streams_b.start_us), tolerance)
    for pair in streams_a.pairs(streams_b):
        differing.compare(pair)
    differing.finish(comparison)
    comparison.hints += scenario_hints(streams_a.scopes, streams_b.scopes)
    return comparison


def _read(events: Iterable[Event]) -> Streams:
    """Return the streams of a run."""
    streams = Streams()
    for event in events:
        streams.add(event, streams.count)
        streams.count += 1
    return streams


class Streams:
    """The sequences of values of interfaces or of statuses of skillers, without repetitions."""

    def __init__(self) -> None:
        self.scopes: set[str] = set()
        self.count = 0
        self.start_us = 0
        self._streams: dict[str, Steps] = {}
        self._skillers = SkillerBacklog()
        self._states: dict[State, State] = {}

    def add(self, event: Event, position: int) -> None:
        """Take the next event of the run; one that only says again what was said last does not count."""
        if not position:
            self.start_us = event.time_us
        if isinstance(event, InterfaceWrite):
            name, text = event.uid, anonymous_fact(interface_text(event.values))
            self.scopes.add(f"interface {name}")
        elif isinstance(event, SkillStatus):
            counts = self._skillers.fresh(event)
            if counts is None:
                return
            self.scopes.add(skill_scope(counts.skill_string))
            name = f"skiller {event.skiller} of {event.env}"
            text = anonymous(f'skill="{counts.skill_string}" status={counts.status}')
        else:
            return
        stream = self._streams.setdefault(name, Steps())
        state = self._states.setdefault((text,), (text,))
        if not stream.states or stream.states[-1] != state:
            stream.append(state, position, event.time_us)

    def pairs(self, other: Streams) -> Iterator[StepPair]:
        """Yield the streams of both runs, those of the same interface or skiller together."""
        for name in {**self._streams, **other._streams}:
            ours, theirs = self._streams.get(name, Steps()), other._streams.get(name, Steps())
            yield StepPair(name, "state", ours, theirs, ours.states, theirs.states)
