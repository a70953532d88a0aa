"""Times are compared within a tolerance, per thread of events."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, RuleFired
from cxbridge.trace.compare.model import Comparison, DifferenceKind, Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, family, goal

SECOND = 1_000_000


def with_times(events: Sequence[Event], late: dict[int, float] | None = None, start: int = 0) -> list[Event]:
    """Return the events a second apart; each index in ``late`` delays the rest of the run by its seconds."""
    delay = 0.0
    events_with_times = []
    for at, event in enumerate(events):
        delay += (late or {}).get(at, 0.0)
        events_with_times.append(replace(event, time_us=start + at * SECOND + round(delay * SECOND)))
    return events_with_times


def compare(
    a: Sequence[Event],
    b: Sequence[Event],
    order: Order,
    tolerance_s: float,
    view: View = View.TRANSITIONS,
) -> Comparison:
    return compare_runs(MemoryRun(a), [MemoryRun(b)], view, order, tolerance_s=tolerance_s)


@pytest.mark.parametrize("order", Order)
def test_delay_is_found_once_per_thread(order: Order) -> None:
    """The skill ends at event 14; its consequences follow."""
    a = with_times(family())
    assert compare(a, with_times(family(), start=77 * SECOND), order, 0).same
    comparison = compare(a, with_times(family(), {14: 2.0}), order, 0.5)
    assert {difference.kind for difference in comparison.differences} == {DifferenceKind.TIME}
    assert comparison.differences[0].a.position == 14
    assert "another time: 2 s later in B" in comparison.differences[0].what
    assert len(comparison.differences) == 4  # the skill, its action, its goal, the parent
    assert compare(a, with_times(family(), {14: 0.4}), order, 0.5).same
    early = compare(a, with_times(family(), {5: -0.6}), order, 0.5).differences
    assert [difference.a.position for difference in early] == [5, 7, 8]
    assert "another time: 0.6 s earlier in B" in early[0].what


@pytest.mark.parametrize("order", Order)
def test_times_are_compared_after_other_differences(order: Order) -> None:
    edited = with_times(family(), {16: 3.0})
    edited[12] = replace(edited[12], skill_string="odd{}")
    kinds = [difference.kind for difference in compare(with_times(family()), edited, order, 1).differences]
    assert kinds[0] is DifferenceKind.CHANGED
    assert DifferenceKind.TIME in kinds


def test_tolerance_includes_its_limit() -> None:
    a = [goal("g", "A"), goal("g", "B", time_us=SECOND)]
    b = [goal("g", "A"), goal("g", "B", time_us=SECOND + 500_000)]
    assert compare(a, b, Order.TOTAL, 0.5).same
    assert not compare(a, b, Order.TOTAL, 0.499999).same


@pytest.mark.parametrize("order", Order)
def test_times_of_interface_writes_are_compared(order: Order) -> None:
    a: list[Event] = [InterfaceWrite(at * SECOND, "A::1", {"x": at}) for at in range(3)]
    b = [*a[:2], replace(a[2], time_us=5 * SECOND)]
    comparison = compare(a, b, order, 1, View.BLACKBOARD)
    assert [difference.kind for difference in comparison.differences] == [DifferenceKind.TIME]


def test_rules_have_no_times_in_partial_order() -> None:
    rules = [RuleFired(0, "e", 1, "r", "")]
    with pytest.raises(TraceError, match="rules have no times that could be compared"):
        compare(rules, rules, Order.PARTIAL, 1, View.RULES)
