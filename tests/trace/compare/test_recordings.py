"""The recordings of Fawkes compare as in their README, at all levels and orders."""

from __future__ import annotations

import pytest

from cxbridge.event_kinds import View
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS, recording

pytestmark = needs_shared
RECORDED = [View.TRANSITIONS, View.SKILLS, View.RULES, View.FACTS]


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("view", RECORDED)
def test_runs_of_skiller_are_same(view: View, order: Order) -> None:
    comparison = compare_runs(
        open_run(recording("skiller-1")), [open_run(recording("skiller-2"))], view, order
    )
    assert comparison.same, comparison.differences[0]
    assert comparison.count_a == comparison.count_b > 0


@pytest.mark.parametrize(
    ("view", "count"),
    [(View.TRANSITIONS, 1), (View.SKILLS, 1), (View.RULES, 0), (View.FACTS, 2)],
)
def test_simulator_differs_in_one_message_id_in_total_order(view: View, count: int) -> None:
    comparison = compare_runs(
        open_run(recording("skiller-1")), [open_run(recording("simulator-1"))], view, Order.TOTAL
    )
    assert len(comparison.differences) == count
    assert all("msgid" in difference.a.text for difference in comparison.differences)


@pytest.mark.parametrize("view", RECORDED)
def test_simulator_is_same_in_partial_order(view: View) -> None:
    logs = [open_run(recording(name)) for name in NAMES]
    assert compare_runs(logs[2], logs[:2], view, Order.PARTIAL).same


@pytest.mark.parametrize("order", Order)
def test_log_and_its_transitions_text_are_same(order: Order) -> None:
    text = open_run(RECORDINGS / "skiller-1" / "trace.txt")
    assert compare_runs(text, [open_run(recording("skiller-1"))], View.TRANSITIONS, order).same
