"""Details such as parameters are compared at the level transitions if all runs have them."""

from __future__ import annotations

from typing import Any

import pytest
from msgspec.structs import replace

from cxbridge.event_kinds import View
from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.trace.codec import encode, make_decoder
from cxbridge.trace.compare.model import DifferenceKind, Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, action, family, goal


def with_details(event: Event, **values: Any) -> Event:
    return replace(event, **values)


WITHOUT = [with_details(event, **dict.fromkeys(event.KIND.detail_fields, "")) for event in family()]


def changed(field: str, value: str) -> list[Event]:
    """Return the family with a changed field in all events of its last goal, or in its only plan-action."""
    if field == "plan":
        return [
            with_details(event, params=value) if isinstance(event, PlanActionTransition) else event
            for event in family()
        ]
    return [
        with_details(event, **{field: value})
        if isinstance(event, GoalTransition) and event.goal == "gen2"
        else event
        for event in family()
    ]


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("field", ["params", "meta", "priority", "resources", "plan"])
def test_field_changed_everywhere_is_one_difference(field, order):
    comparison = compare_runs(
        MemoryRun(family()), [MemoryRun(changed(field, "(odd)"))], View.TRANSITIONS, order
    )
    (difference,) = comparison.differences
    assert difference.kind is DifferenceKind.CHANGED
    assert "(odd)" in difference.b.text
    assert "(odd)" not in difference.a.text


@pytest.mark.parametrize("order", Order)
def test_details_missing_in_one_run_are_not_compared(order):
    odd = changed("params", "(odd)")
    for pair in ((odd, WITHOUT), (WITHOUT, odd), (WITHOUT, WITHOUT)):
        first, second = map(MemoryRun, pair)
        assert compare_runs(first, [second], View.TRANSITIONS, order).same
    assert not compare_runs(MemoryRun(odd), [MemoryRun(family())], View.TRANSITIONS, order).same


@pytest.mark.parametrize("order", Order)
def test_names_and_times_in_details_are_no_difference(order):
    runs = [
        MemoryRun(
            [
                replace(
                    goal(name, "FORMULATED"), params=f"(of {name} at {second} 5)", meta=f"(start {second})"
                ),
                replace(action(name, "1", "PENDING"), params=f'("text of {name}" <Fact-{index}>)'),
            ]
        )
        for name, second, index in (("gen7", 1700000000, 12), ("gen99", 1800000001, 345))
    ]
    assert compare_runs(runs[0], runs[1:], View.TRANSITIONS, order).same


def test_recording_of_earlier_version_is_read():
    event = goal("gen1", "FORMULATED")
    text = encode(event).decode()
    for name in event.KIND.detail_fields:
        text = text.replace(f',"{name}":"{getattr(event, name)}"', "")
    assert "params" not in text
    decoded = make_decoder(type(event))(text.encode())
    assert decoded == replace(event, params="", meta="", priority="", resources="")
