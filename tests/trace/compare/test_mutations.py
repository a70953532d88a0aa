"""Comparisons find all mutations of a run, and ignore renamed ids and independent orders."""

from __future__ import annotations

from functools import cache
from random import Random

import pytest

from cxbridge.event_kinds import View
from cxbridge.events import Event
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from tests.support import many, needs_shared
from tests.trace.mutations import MUTATIONS, Mutation, renumber, shuffle
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, family, recording

TOTAL = many(1000, 30)
"""The total number of mutations, and of renamings."""
ROUNDS = many(15, 5)

LEVELS = [View.TRANSITIONS, View.SKILLS, View.RULES, View.FACTS, View.BLACKBOARD]


@cache
def _recorded(name: str) -> list[Transition]:
    return [event for event in open_run(recording(name)) if isinstance(event, TRANSITION_TYPES)]


@cache
def _recorded_events(name: str, view: View) -> list[Event]:
    """Return the events of a level in a recording."""
    paths = [recording(name)]
    if view is View.BLACKBOARD:
        paths = sorted((RECORDINGS / name / "bblogger-repaired").glob("*.log"))
    return [event for path in paths for event in open_run(path) if isinstance(event, view.event_types)]


def _small_run() -> list[Transition]:
    return [event for event in family() if isinstance(event, TRANSITION_TYPES)]


def _is_same(first: list[Transition], second: list[Transition], order: Order) -> bool:
    return compare_runs(MemoryRun(first), [MemoryRun(second)], View.TRANSITIONS, order).same


def _mutant(mutation: Mutation, events: list[Transition], random: Random) -> list[Transition]:
    while (mutant := mutation(events, random)) is None:
        pass
    return mutant


@needs_shared
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_each_mutation_of_recording_is_found(mutation: Mutation, name: str) -> None:
    events = _recorded(name)
    for seed in range(-(-TOTAL // (len(MUTATIONS) * len(NAMES)))):
        random = Random(f"{mutation.__name__} {name} {seed}")
        mutant = renumber(_mutant(mutation, events, random), random)
        assert not _is_same(events, mutant, Order.PARTIAL), seed
        assert not _is_same(events, mutant, Order.TOTAL), seed


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_each_mutation_of_small_run_is_found(mutation: Mutation) -> None:
    events = _small_run()
    for seed in range(ROUNDS):
        random = Random(f"{mutation.__name__} {seed}")
        mutant = _mutant(mutation, events, random)
        assert not _is_same(events, mutant, Order.PARTIAL), seed
        assert not _is_same(events, renumber(mutant, random), Order.PARTIAL), seed
        assert not _is_same(events, renumber(mutant, random), Order.TOTAL), seed


@needs_shared
@pytest.mark.parametrize("view", LEVELS)
@pytest.mark.parametrize("name", NAMES)
def test_renamed_ids_and_times_of_recording_make_no_difference(name: str, view: View) -> None:
    events = _recorded_events(name, view)
    for seed in range(-(-TOTAL // (len(NAMES) * len(LEVELS)))):
        renamed = renumber(events, Random(f"{name} {seed}"))
        assert renamed != events
        for order in Order:
            comparison = compare_runs(MemoryRun(events), [MemoryRun(renamed)], view, order)
            assert comparison.same, (seed, order, comparison.differences[0])


@needs_shared
@pytest.mark.parametrize("view", [View.SKILLS, View.RULES, View.FACTS, View.BLACKBOARD])
def test_dropped_and_swapped_events_are_found_at_each_level(view: View) -> None:
    events = _recorded_events("skiller-1", view)
    for seed in range(ROUNDS):
        random = Random(f"{view.value} {seed}")
        at = random.randrange(len(events) - 1)
        dropped = [*events[:at], *events[at + 1 :]]
        swapped = [*events[:at], events[at + 1], events[at], *events[at + 2 :]]
        comparison = compare_runs(MemoryRun(events), [MemoryRun(renumber(dropped, random))], view)
        assert (len(comparison.differences), comparison.count_b) == (1, len(events) - 1), seed
        same = compare_runs(MemoryRun(events), [MemoryRun(swapped)], view).same
        assert same == compare_runs(MemoryRun([events[at]]), [MemoryRun([events[at + 1]])], view).same, seed


def test_renamed_ids_of_small_run_make_no_difference() -> None:
    events = _small_run()
    for seed in range(ROUNDS):
        renamed = renumber(events, Random(seed))
        assert _is_same(events, renamed, Order.TOTAL)
        assert _is_same(renamed, events, Order.PARTIAL)


@pytest.mark.parametrize(
    "source", [pytest.param(lambda: _recorded("skiller-1"), marks=needs_shared, id="recorded"), _small_run]
)
def test_order_of_independent_events_makes_no_difference(source) -> None:
    events = source()
    for seed in range(ROUNDS):
        random = Random(seed)
        shuffled = renumber(shuffle(events, random), random)
        assert not _is_same(events, shuffled, Order.TOTAL)
        comparison = compare_runs(MemoryRun(events), [MemoryRun(shuffled)], View.TRANSITIONS, Order.PARTIAL)
        assert comparison.same, comparison.differences[0]
