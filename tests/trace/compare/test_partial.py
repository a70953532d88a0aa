"""Partial order: the differences that count, and the differences that do not."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from cxbridge.events import Event
from cxbridge.trace.compare.model import Comparison, Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, action, family, goal, skill


def compare(a: Sequence[Event], *others: Sequence[Event]) -> Comparison:
    return compare_runs(MemoryRun(a), [MemoryRun(events) for events in others], order=Order.PARTIAL)


def test_later_parent_equals_parent_from_start() -> None:
    later = [
        goal("gen1", "FORMULATED"),
        goal("R-gen2", "FORMULATED"),
        goal("gen1", "FORMULATED", parent="R-gen2"),
    ]
    at_once = [goal("R-gen2", "FORMULATED"), goal("gen1", "FORMULATED", parent="R-gen2")]
    assert compare(later, at_once).same


def test_last_parent_counts() -> None:
    child = [goal("R-gen2", "FORMULATED"), goal("gen1", "FORMULATED", parent="R-gen2")]
    comparison = compare(child, [goal("R-gen2", "FORMULATED"), goal("gen1", "FORMULATED")])
    assert [difference.what for difference in comparison.differences] == [
        "a goal that only A has",
        "a goal that only B has",
    ]


def test_equal_siblings_may_change_places() -> None:
    events = family()
    edited = [
        goal("gen2", "FORMULATED", parent="RUN-gen3"),
        goal("gen1", "FORMULATED", parent="RUN-gen3"),
        *[event for event in events if getattr(event, "mode", "") != "FORMULATED"],
    ]
    edited.insert(0, goal("RUN-gen3", "FORMULATED", goal_class="PARENT"))
    assert compare(events, edited).same


def test_different_siblings_are_paired_by_similarity() -> None:
    modes = ("FORMULATED", "SELECTED", "DISPATCHED", "FINISHED"), ("FORMULATED", "EXPANDED", "COMMITTED")
    a = [goal(f"gen{number}", mode) for number in (0, 1) for mode in modes[number]]
    b = [goal(f"gen{8 - number}", mode) for number in (1, 0) for mode in (*modes[number], "RETRACTED")]
    differences = compare(a, b).differences
    assert [(difference.kind.value, "RETRACTED" in difference.b.text) for difference in differences] == [
        ("only-b", True)
    ] * 2


def test_child_and_parent_keep_their_order() -> None:
    events = family()
    early = [events[-1], *events[:-1]]
    early = [*events[:-2], events[-1], events[-2]]  # the parent ends before its child
    comparison = compare(events, early)
    assert not comparison.same
    assert "on the other side of transitions of goal RUN-gen3" in comparison.differences[0].what


def test_plans_with_numbered_ids_are_compared_in_order() -> None:
    first, second, third = (
        [
            goal("gen1", "X"),
            *(replace(action("gen1", "1", state), plan=f"plan-gen{state}") for state in order),
        ]
        for order in ("12", "12", "32")
    )
    assert compare(first, second).same
    assert not compare(first, third).same


def test_plan_and_goal_keep_their_order() -> None:
    events = [goal("gen1", "FORMULATED"), goal("gen1", "EXPANDED"), action("gen1", "1", "RUNNING")]
    assert not compare(events, [events[0], events[2], events[1]]).same


def test_only_orders_common_to_all_other_runs_count() -> None:
    """Two recordings with both orders of a child's end and its parent's end allow both orders."""
    events = family()
    parent_first = [*events[:-2], events[-1], events[-2]]
    assert compare(events, events, parent_first).same
    assert compare(parent_first, events, parent_first).same
    assert not compare(parent_first, events, events).same


def test_repeated_status_and_message_ids_do_not_count() -> None:
    once = [skill("", "S_INACTIVE", 0), skill("say{}", "S_RUNNING", 2), skill("say{}", "S_FINAL", 2)]
    repeated = [skill("", "S_INACTIVE", 1), *once[1:], skill("say{}", "S_FINAL", 3)]
    assert compare([*family(), *once], [*family(), *repeated]).same


def test_error_with_other_goal_is_found() -> None:
    events = family()
    edited = [
        *events[:-1],
        goal("RUN-gen3", "FINISHED", "FAILED", goal_class="PARENT", error="SUB-GOAL-FAILED gen1"),
    ]
    comparison = compare(events, edited)
    assert comparison.differences[0].subject == "goal /RUN"


def test_goal_in_error_is_distinguished_from_foreign_goal() -> None:
    def pair(failed: str) -> list[Event]:
        error = f"SUB-GOAL-FAILED {failed}"
        parent = [goal("R-gen3", "FORMULATED"), goal("R-gen3", "FINISHED", "FAILED", error=error)]
        children = [goal(name, "FORMULATED", parent="R-gen3") for name in ("gen1", "gen2")]
        return [parent[0], *children, parent[1]]

    assert compare(pair("gen1"), pair("gen2")).same
    assert not compare(pair("gen1"), pair("gen7")).same


def test_circle_of_parents_is_compared() -> None:
    ring = [goal("gen1", "FORMULATED", parent="gen2"), goal("gen2", "FORMULATED", parent="gen1")]
    assert compare(ring, ring).same
    assert not compare(ring, ring[:1]).same
