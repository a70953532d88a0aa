"""Parameters and the like count at the level transitions, when all runs have them."""

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


WITHOUT = [with_details(event, **dict.fromkeys(event.KIND.details, "")) for event in family()]


def changed(field: str, value: str) -> list[Event]:
    """The family, in which one field of all events of its last goal or its only plan-action is another."""
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
def test_one_that_differs_everywhere_is_one_difference(field, order):
    comparison = compare_runs(
        MemoryRun(family()), [MemoryRun(changed(field, "(odd)"))], View.TRANSITIONS, order
    )
    (difference,) = comparison.differences
    assert difference.kind is DifferenceKind.CHANGED
    assert "(odd)" in difference.b.text
    assert "(odd)" not in difference.a.text


@pytest.mark.parametrize("order", Order)
def test_what_one_run_does_not_record_does_not_count(order):
    odd = changed("params", "(odd)")
    for pair in ((odd, WITHOUT), (WITHOUT, odd), (WITHOUT, WITHOUT)):
        one, other = map(MemoryRun, pair)
        assert compare_runs(one, [other], View.TRANSITIONS, order).same
    assert not compare_runs(MemoryRun(odd), [MemoryRun(family())], View.TRANSITIONS, order).same


@pytest.mark.parametrize("order", Order)
def test_names_and_times_in_them_are_no_difference(order):
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


def test_a_recording_of_an_earlier_version_is_read():
    event = goal("gen1", "FORMULATED")
    text = encode(event).decode()
    for name in event.KIND.details:
        text = text.replace(f',"{name}":"{getattr(event, name)}"', "")
    assert "params" not in text
    found = make_decoder(type(event))(text.encode())
    assert found == replace(event, params="", meta="", priority="", resources="")
