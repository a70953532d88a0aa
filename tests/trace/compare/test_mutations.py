"""Every change that matters is found, every change that does not is not."""

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
"""Mutations, and renamings."""
ROUNDS = many(15, 5)

LEVELS = [View.TRANSITIONS, View.SKILLS, View.RULES, View.FACTS, View.BLACKBOARD]


@cache
def _recorded(name: str) -> list[Transition]:
    return [event for event in open_run(recording(name)) if isinstance(event, TRANSITION_TYPES)]


@cache
def _everything(name: str, view: View) -> list[Event]:
    """All events of a level that a recording has."""
    paths = [recording(name)]
    if view is View.BLACKBOARD:
        paths = sorted((RECORDINGS / name / "bblogger-repaired").glob("*.log"))
    return [event for path in paths for event in open_run(path) if isinstance(event, view.event_types)]


def _small() -> list[Transition]:
    return [event for event in family() if isinstance(event, TRANSITION_TYPES)]


def _same(one: list[Transition], other: list[Transition], order: Order) -> bool:
    return compare_runs(MemoryRun(one), [MemoryRun(other)], View.TRANSITIONS, order).same


def _mutant(mutation: Mutation, events: list[Transition], random: Random) -> list[Transition]:
    while (mutant := mutation(events, random)) is None:
        pass
    return mutant


@needs_shared
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_every_mutation_of_a_recording_is_found(mutation: Mutation, name: str) -> None:
    events = _recorded(name)
    for seed in range(-(-TOTAL // (len(MUTATIONS) * len(NAMES)))):
        random = Random(f"{mutation.__name__} {name} {seed}")
        mutant = renumber(_mutant(mutation, events, random), random)
        assert not _same(events, mutant, Order.PARTIAL), seed
        assert not _same(events, mutant, Order.TOTAL), seed


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_every_mutation_of_a_small_run_is_found(mutation: Mutation) -> None:
    events = _small()
    for seed in range(ROUNDS):
        random = Random(f"{mutation.__name__} {seed}")
        mutant = _mutant(mutation, events, random)
        assert not _same(events, mutant, Order.PARTIAL), seed
        assert not _same(events, renumber(mutant, random), Order.PARTIAL), seed
        assert not _same(events, renumber(mutant, random), Order.TOTAL), seed


@needs_shared
@pytest.mark.parametrize("view", LEVELS)
@pytest.mark.parametrize("name", NAMES)
def test_other_names_and_times_make_no_difference(name: str, view: View) -> None:
    events = _everything(name, view)
    for seed in range(-(-TOTAL // (len(NAMES) * len(LEVELS)))):
        other = renumber(events, Random(f"{name} {seed}"))
        assert other != events
        for order in Order:
            comparison = compare_runs(MemoryRun(events), [MemoryRun(other)], view, order)
            assert comparison.same, (seed, order, comparison.differences[0])


@needs_shared
@pytest.mark.parametrize("view", [View.SKILLS, View.RULES, View.FACTS, View.BLACKBOARD])
def test_what_was_dropped_or_exchanged_is_found_at_every_level(view: View) -> None:
    events = _everything("skiller-1", view)
    for seed in range(ROUNDS):
        random = Random(f"{view.value} {seed}")
        at = random.randrange(len(events) - 1)
        dropped = [*events[:at], *events[at + 1 :]]
        swapped = [*events[:at], events[at + 1], events[at], *events[at + 2 :]]
        comparison = compare_runs(MemoryRun(events), [MemoryRun(renumber(dropped, random))], view)
        assert (len(comparison.differences), comparison.count_b) == (1, len(events) - 1), seed
        same = compare_runs(MemoryRun(events), [MemoryRun(swapped)], view).same
        assert same == compare_runs(MemoryRun([events[at]]), [MemoryRun([events[at + 1]])], view).same, seed


def test_other_ids_of_a_small_run_make_no_difference() -> None:
    events = _small()
    for seed in range(ROUNDS):
        other = renumber(events, Random(seed))
        assert _same(events, other, Order.TOTAL)
        assert _same(other, events, Order.PARTIAL)


@pytest.mark.parametrize(
    "source", [pytest.param(lambda: _recorded("skiller-1"), marks=needs_shared, id="recorded"), _small]
)
def test_another_order_of_what_is_independent_makes_no_difference(source) -> None:
    events = source()
    for seed in range(ROUNDS):
        random = Random(seed)
        other = renumber(shuffle(events, random), random)
        assert not _same(events, other, Order.TOTAL)
        comparison = compare_runs(MemoryRun(events), [MemoryRun(other)], View.TRANSITIONS, Order.PARTIAL)
        assert comparison.same, comparison.differences[0]
