"""Comparison of the sequences of steps of a goal, plan, Skiller or interface, in partial order.

A step is an event with its state: the content without names that differ between runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, TypeAlias

from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.trace.compare.align import MISSING
from cxbridge.trace.compare.checks import TimeCheck, describe_lag
from cxbridge.trace.compare.edits import ONE_SIDED_KINDS, Alignment, Edit
from cxbridge.trace.compare.keys import StaleStateFilter
from cxbridge.trace.compare.model import (
    Comparison,
    Difference,
    DifferenceKind,
    Order,
    Side,
    sort_differences,
)
from cxbridge.trace.compare.names import interface_text, replace_fact_names, replace_names

State: TypeAlias = tuple[str, ...]
"""The compared content of a step."""


class Step(NamedTuple):
    """A step of a goal, plan, Skiller or interface.

    :param position: the number of the event among the compared events, from 0.
    :param time_us: the time of the event in microseconds.
    """

    state: State
    position: int
    time_us: int


Steps: TypeAlias = Sequence[Step]


def step_states(steps: Steps) -> tuple[State, ...]:
    """Return the states of steps in order."""
    return tuple(step.state for step in steps)


@dataclass(frozen=True)
class StepPair:
    """The steps of one goal, plan, Skiller or interface in both runs, with equal names.

    :param subject: the goal, plan, Skiller or interface.
    :param noun: the noun for a step in reports.
    :param steps: the steps of both runs.
    :param has_times: whether to compare times; False for details, whose transitions have the same times.
    """

    subject: str
    noun: str
    steps: tuple[Steps, Steps]
    has_times: bool = True

    def find_differences(self, time_check: TimeCheck | None) -> Iterator[Difference]:
        """Yield the differences in the order of the first run, those of times last.

        :param time_check: compares the times; None: times are not compared.
        """
        states = [step_states(steps) for steps in self.steps]
        if states[0] == states[1] and time_check is None:
            return
        alignment = Alignment(*states)
        # all states have the same subject, so that states between the same pairs count as changed
        edits = alignment.find_edits(
            lambda run_index, index: states[run_index][index],
            lambda _run_index, _index: None,
            lambda _run_index, _index: None,
        )
        yield from (self._make_difference(alignment, edit) for edit in edits)
        if time_check and self.has_times:
            yield from self._find_late_steps(alignment, time_check)

    def _find_late_steps(self, alignment: Alignment, time_check: TimeCheck) -> Iterator[Difference]:
        steps_a, steps_b = self.steps
        for index_a, index_b in alignment.pairs:
            step_a, step_b = steps_a[index_a], steps_b[index_b]
            lag_s = time_check.measure_exceeding_lag_s(self.subject, step_a.time_us, step_b.time_us)
            if lag_s is not None:
                description = f"its {self.noun} number {index_a + 1}: {describe_lag(lag_s)}"
                yield Difference(
                    description, self.subject, _make_side(step_a), _make_side(step_b), DifferenceKind.TIME
                )

    def _make_difference(self, alignment: Alignment, edit: Edit) -> Difference:
        index_a, index_b = edit.indices
        index, run_name = (index_b, "B") if index_a == MISSING else (index_a, "A")
        description = f"its {self.noun} number {index + 1}"
        if edit.count > 1:
            description = f"its {self.noun}s number {index + 1} to {index + edit.count}"
        if edit.kind is DifferenceKind.ORDER:
            description = f"{description}, in B from number {index_b + 1} on"
        elif edit.kind in ONE_SIDED_KINDS:
            description = f"{description}, which only {run_name} has"
        side_a, side_b = (
            _make_side(self.steps[run_index][index])
            if index != MISSING
            else self._make_missing_side(run_index, alignment.preceding_index(run_index, edit))
            for run_index, index in enumerate(edit.indices)
        )
        return Difference(description, self.subject, side_a, side_b, edit.kind, edit.count)

    def _make_missing_side(self, run_index: int, preceding_index: int) -> Side:
        """Return the side of a run without a step.

        :param preceding_index: the index of the preceding step, or -1.
        """
        steps = self.steps[run_index]
        if not steps:
            return Side(None, f"(no {self.noun})")
        adverb = "no further" if preceding_index == len(steps) - 1 else "no such"
        return Side(
            steps[preceding_index].position if preceding_index != MISSING else None, f"({adverb} {self.noun})"
        )


def find_step_differences(
    pairs: Iterable[StepPair], tolerance_s: float | None = None
) -> Iterator[Difference]:
    """Yield the differences between the steps of both runs.

    :param tolerance_s: the allowed difference between times; None: times are not compared.
    """
    time_check = None if tolerance_s is None else TimeCheck(tolerance_s)
    return chain.from_iterable(pair.find_differences(time_check) for pair in pairs)


def _make_side(step: Step) -> Side:
    return Side(step.position, state_text(step.state))


def state_text(state: State) -> str:
    """Return a state as one line."""
    return " ".join(state).strip()


def compare_streams(
    a: Iterable[Event], b: Iterable[Event], view: View, tolerance_s: float | None = None
) -> Comparison:
    """Compare the sequence of values of each interface or Skiller, without repetitions.

    :param a: the compared events of one run.
    :param b: the compared events of the other run.
    """
    streams_a, streams_b = ValueStreams(a), ValueStreams(b)
    differences = find_step_differences(streams_a.pair_streams(streams_b), tolerance_s)
    return Comparison(view, Order.PARTIAL, streams_a.count, streams_b.count, sort_differences(differences))


class ValueStreams:
    """The sequences of values of interfaces, or of statuses of Skillers, without repetitions."""

    def __init__(self, events: Iterable[Event] = ()) -> None:
        self.count = 0
        self._streams: dict[str, list[Step]] = {}
        self._skillers = StaleStateFilter()
        for event in events:
            self.add(event, self.count)
            self.count += 1

    def add(self, event: Event, position: int) -> None:
        """Add the next event of the run unless it repeats the last state."""
        if isinstance(event, InterfaceWrite):
            name, text = event.uid, replace_fact_names(interface_text(event.values))
        else:
            assert isinstance(event, SkillStatus)
            fresh_state = self._skillers.fresh_state(event)
            if fresh_state is None:
                return
            name = f"skiller {event.skiller} of {event.env}"
            text = replace_names(f'skill="{fresh_state.skill_string}" status={fresh_state.status}')
        stream = self._streams.setdefault(name, [])
        # the load of the machine decides how often a writer repeats a value
        if not stream or stream[-1].state != (text,):
            stream.append(Step((text,), position, event.time_us))

    def pair_streams(self, other: ValueStreams) -> Iterator[StepPair]:
        """Yield the streams of both runs, paired by name."""
        for name in {**self._streams, **other._streams}:
            yield StepPair(name, "state", (self._streams.get(name, ()), other._streams.get(name, ())))
