"""Times count when a tolerance is given, from the thread or from the begin."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, RuleFired
from cxbridge.trace.compare.checks import TimeReference, Tolerance
from cxbridge.trace.compare.model import Comparison, DifferenceKind, Order
from cxbridge.trace.compare.render.text import make_report
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, family, goal, skill

SECOND = 1_000_000


def timed(events: Sequence[Event], late: dict[int, float] | None = None, start: int = 0) -> list[Event]:
    """The events a second apart; from some of them on the run is late by so many seconds."""
    delay = 0.0
    found = []
    for at, event in enumerate(events):
        delay += (late or {}).get(at, 0.0)
        found.append(replace(event, time_us=start + at * SECOND + round(delay * SECOND)))
    return found


def compare(
    a: Sequence[Event], b: Sequence[Event], order: Order, seconds: float, since: TimeReference
) -> Comparison:
    tolerance = Tolerance(seconds, since)
    return compare_runs(MemoryRun(a), [MemoryRun(b)], order=order, tolerance=tolerance)


@pytest.mark.parametrize("since", TimeReference)
@pytest.mark.parametrize("order", Order)
def test_another_start_makes_no_difference(order: Order, since: TimeReference) -> None:
    assert compare(timed(family()), timed(family(), start=77 * SECOND), order, 0, since).same


@pytest.mark.parametrize("order", Order)
def test_a_delay_is_found_once_in_its_thread(order: Order) -> None:
    """At event 14 the skill is over: its status, then what follows from it."""
    a, b = timed(family()), timed(family(), {14: 2.0})
    comparison = compare(a, b, order, 0.5, TimeReference.THREAD)
    assert {difference.kind for difference in comparison.differences} == {DifferenceKind.TIME}
    assert comparison.differences[0].a.position == 14
    assert "another time: 2 s later in B" in comparison.differences[0].what
    assert len(comparison.differences) == 4  # the skill, its action, its goal, the parent
    assert make_report(comparison, MemoryRun(a), [MemoryRun(b)]).comparison.rows
    assert compare(timed(family()), timed(family(), {14: 0.4}), order, 0.5, TimeReference.THREAD).same


@pytest.mark.parametrize("order", Order)
def test_after_a_delay_everything_is_late_from_the_begin(order: Order) -> None:
    comparison = compare(timed(family()), timed(family(), {14: -0.6}), order, 0.5, TimeReference.BEGIN)
    assert [difference.a.position for difference in comparison.differences] == [14, 15, 16, 17]
    assert "another time: 0.6 s earlier in B" in comparison.differences[0].what


@pytest.mark.parametrize("order", Order)
def test_times_are_compared_behind_other_differences_too(order: Order) -> None:
    events = timed(family())
    other = timed(family(), {16: 3.0})
    other[12] = replace(other[12], skill_string="odd{}")
    comparison = compare(events, other, order, 1, TimeReference.THREAD)
    kinds = [difference.kind for difference in comparison.differences]
    assert kinds[0] is DifferenceKind.CHANGED
    assert DifferenceKind.TIME in kinds


def test_a_limit_is_within() -> None:
    a = [goal("g", "A"), goal("g", "B", time_us=SECOND)]
    b = [goal("g", "A"), goal("g", "B", time_us=SECOND + 500_000)]
    assert compare(a, b, Order.TOTAL, 0.5, TimeReference.BEGIN).same
    assert not compare(a, b, Order.TOTAL, 0.499999, TimeReference.BEGIN).same


@pytest.mark.parametrize("order", Order)
def test_interfaces_have_times_as_well(order: Order) -> None:
    a: list[Event] = [InterfaceWrite(at * SECOND, "A::1", {"x": at}) for at in range(3)]
    b = [*a[:2], replace(a[2], time_us=5 * SECOND)]
    tolerance = Tolerance(1)
    comparison = compare_runs(MemoryRun(a), [MemoryRun(b)], View.BLACKBOARD, order, tolerance=tolerance)
    assert [difference.kind for difference in comparison.differences] == [DifferenceKind.TIME]


def test_firings_have_no_partners_in_partial_order() -> None:
    rules = [RuleFired(0, "e", 1, "r", "")]
    with pytest.raises(TraceError, match="rules have no times that could be compared"):
        compare_runs(MemoryRun(rules), [MemoryRun(rules)], View.RULES, Order.PARTIAL, tolerance=Tolerance(1))


def test_a_clock_that_goes_backwards_is_survived() -> None:
    events = [skill("a", "S_RUNNING"), skill("a", "S_FINAL")]
    a = [replace(events[0], time_us=5 * SECOND), replace(events[1], time_us=0)]
    assert compare(a, a, Order.TOTAL, 0, TimeReference.THREAD).same
    assert not compare(a, timed(events), Order.TOTAL, 1, TimeReference.THREAD).same


@pytest.mark.parametrize("order", Order)
def test_a_thread_is_late_once_and_from_the_begin_for_ever(order: Order) -> None:
    a, b = timed(family()), timed(family(), {5: 2.0})
    by_thread = compare(a, b, order, 0.5, TimeReference.THREAD).differences
    assert [difference.a.position for difference in by_thread] == [5, 7, 8]
    by_begin = compare(a, b, order, 0.5, TimeReference.BEGIN).differences
    assert [difference.a.position for difference in by_begin] == list(range(5, 18))
