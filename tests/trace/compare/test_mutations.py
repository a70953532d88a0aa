"""Every change that matters is found, every change that does not is not."""

from __future__ import annotations

from random import Random

import pytest

from cxbridge.trace.compare.result import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.levels import View
from cxbridge.transitions import TRANSITION_TYPES, Transition
from tests.support import needs_shared
from tests.trace.mutations import MUTATIONS, Mutation, renumber, shuffle
from tests.trace.runs import MemoryRun, family, recording

ROUNDS = 15


def _recorded() -> list[Transition]:
    return [event for event in open_run(recording("skiller-1")) if isinstance(event, TRANSITION_TYPES)]


def _small() -> list[Transition]:
    return [event for event in family() if isinstance(event, TRANSITION_TYPES)]


def _same(one: list[Transition], other: list[Transition], order: Order) -> bool:
    return compare_runs(MemoryRun(one), [MemoryRun(other)], View.TRANSITIONS, order).same


def _mutants(mutation: Mutation, events: list[Transition], random: Random):
    found = 0
    while found < ROUNDS:
        mutant = mutation(events, random)
        if mutant is not None:
            found += 1
            yield mutant


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
@pytest.mark.parametrize("source", [pytest.param(_recorded, marks=needs_shared), _small])
def test_every_mutation_is_found(mutation: Mutation, source) -> None:
    events = source()
    random = Random(f"{mutation.__name__} {len(events)}")
    for mutant in _mutants(mutation, events, random):
        assert not _same(events, mutant, Order.PARTIAL)
        assert not _same(events, renumber(mutant, random), Order.PARTIAL)
        assert not _same(events, renumber(mutant, random), Order.TOTAL)


@pytest.mark.parametrize("source", [pytest.param(_recorded, marks=needs_shared), _small])
def test_other_ids_and_times_make_no_difference(source) -> None:
    events = source()
    for seed in range(ROUNDS):
        other = renumber(events, Random(seed))
        assert _same(events, other, Order.TOTAL)
        assert _same(other, events, Order.PARTIAL)


@pytest.mark.parametrize("source", [pytest.param(_recorded, marks=needs_shared), _small])
def test_another_order_of_what_is_independent_makes_no_difference(source) -> None:
    events = source()
    for seed in range(ROUNDS):
        random = Random(seed)
        other = renumber(shuffle(events, random), random)
        assert not _same(events, other, Order.TOTAL)
        comparison = compare_runs(MemoryRun(events), [MemoryRun(other)], View.TRANSITIONS, Order.PARTIAL)
        assert comparison.same, comparison.differences[0]
