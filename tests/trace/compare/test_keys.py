"""The first status of a used Skiller, the end of its last skill, makes no difference to a fresh Skiller."""

from __future__ import annotations

import pytest

from cxbridge.event_kinds import View
from cxbridge.events import SkillStatus
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun

States = list[tuple[str, int, str]]

FRESH: States = [("", 0, "S_INACTIVE"), ("a", 2, "S_RUNNING"), ("a", 2, "S_FINAL")]


def is_same(a: States, b: States, view: View, order: Order) -> bool:
    runs = [
        MemoryRun(SkillStatus(at, "executive", "Skiller", *state) for at, state in enumerate(states))
        for states in (a, b)
    ]
    return compare_runs(runs[0], [runs[1]], view, order).same


@pytest.mark.parametrize("order", list(Order))
@pytest.mark.parametrize("view", [View.SKILLS, View.TRANSITIONS])
@pytest.mark.parametrize(
    ("used", "expected"),
    [
        ([("z", 5, "S_FINAL"), ("z", 5, "S_FINAL"), ("a", 7, "S_RUNNING"), ("a", 7, "S_FINAL")], True),
        ([("z", 5, "S_FAILED"), ("a", 2, "S_RUNNING"), ("a", 2, "S_FINAL")], True),
        ([("a", 5, "S_FINAL"), ("a", 1, "S_FINAL"), ("a", 2, "S_RUNNING"), ("a", 2, "S_FINAL")], True),
        ([("z", 5, "S_FINAL"), ("b", 7, "S_RUNNING"), ("b", 7, "S_FINAL")], False),
        ([("z", 5, "S_FINAL"), ("a", 7, "S_RUNNING")], False),
        ([("z", 5, "S_FINAL"), ("y", 6, "S_FINAL"), ("a", 7, "S_RUNNING"), ("a", 7, "S_FINAL")], False),
        ([("z", 5, "S_RUNNING"), ("a", 7, "S_RUNNING"), ("a", 7, "S_FINAL")], False),
        ([("z", 5, "S_INACTIVE"), ("a", 7, "S_RUNNING"), ("a", 7, "S_FINAL")], False),
    ],
)
def test_first_status_of_used_skiller_equals_fresh_skiller(
    used: States, expected: bool, view: View, order: Order
) -> None:
    assert is_same(used, FRESH, view, order) is expected
    assert is_same(FRESH, used, view, order) is expected


@pytest.mark.parametrize("order", list(Order))
def test_later_repeated_end_differs_in_total_order_only(order: Order) -> None:
    twice = [*FRESH, FRESH[-1]]
    assert is_same(FRESH, twice, View.SKILLS, order) is (order is Order.PARTIAL)
