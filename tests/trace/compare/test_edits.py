"""The differences of edited runs: each edit is reported once, in the words of a reader."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from cxbridge.event_kinds import View
from cxbridge.events import Event, RuleFired, SkillStatus
from cxbridge.trace.compare.model import Comparison, DifferenceKind, Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, action, family, goal, skill


def compare(
    a: Sequence[Event], b: Sequence[Event], order: Order = Order.TOTAL, view: View = View.TRANSITIONS
) -> Comparison:
    return compare_runs(MemoryRun(a), [MemoryRun(b)], view, order)


def kinds(comparison: Comparison) -> list[DifferenceKind]:
    return [difference.kind for difference in comparison.differences]


def rename_goals(events: Sequence[Event], names: dict[str, str]) -> list[Event]:
    def text(value: str) -> str:
        return re.sub(r"gen\d+", lambda match: names.get(match.group(), match.group()), value)

    rename_goals = []
    for event in events:
        fields = {
            name: text(getattr(event, name))
            for name in ("goal", "parent", "plan", "error")
            if hasattr(event, name)
        }
        rename_goals.append(replace(event, **fields))
    return rename_goals


START = 12
"""Index of the start of the family's skill; without the start, the end belongs to an earlier run."""


def two_goals() -> list[Event]:
    return [
        goal("gen1", "FORMULATED", goal_class="FIRST"),
        goal("gen2", "FORMULATED", goal_class="SECOND"),
        *(
            goal(name, mode, goal_class=kind)
            for mode in ("SELECTED", "EXPANDED", "FINISHED")
            for name, kind in (("gen1", "FIRST"), ("gen2", "SECOND"))
        ),
    ]


def test_other_order_of_goals_is_one_difference() -> None:
    """The ids are swapped as well, as by gensym: all later events differ in ids only."""
    events = two_goals()
    edited = rename_goals([events[1], events[0], *events[2:]], {"gen1": "gen2", "gen2": "gen1"})
    comparison = compare(events, edited)
    assert kinds(comparison) == [DifferenceKind.ORDER]
    assert comparison.differences[0].subject == "goal gen1 of class FIRST"
    assert comparison.hints == [
        "only the order differs: compare with --order partial if the order does not matter"
    ]
    assert compare(events, edited, Order.PARTIAL).same


@pytest.mark.parametrize("at", [at for at in range(len(family())) if at != START])
def test_missing_event_is_one_difference_at_its_position(at: int) -> None:
    events = family()
    edited = [*events[:at], *events[at + 1 :]]
    comparison = compare(events, edited)
    (difference,) = comparison.differences
    assert (difference.kind, difference.count) in {(DifferenceKind.ONLY_A, 1), (DifferenceKind.CHANGED, 1)}
    assert difference.a.position == at
    (difference,) = compare(edited, events).differences
    assert difference.b.position == at


@pytest.mark.parametrize("at", range(len(family()) - 1))
def test_swapped_neighbours_are_one_difference(at: int) -> None:
    events = family()
    edited = [*events[:at], events[at + 1], events[at], *events[at + 2 :]]
    comparison = compare(events, edited)
    assert kinds(comparison) == [DifferenceKind.ORDER]
    assert comparison.differences[0].position == at


def test_missing_goal_is_one_difference() -> None:
    events = two_goals()
    events[4:4] = [action("gen1", "1", state) for state in ("PENDING", "RUNNING", "FINAL")]
    edited = [event for event in events if getattr(event, "goal", "") != "gen1"]
    (difference,) = compare(events, edited).differences
    assert (difference.what, difference.count) == ("a goal that only A has, with 7 events", 7)
    (difference,) = compare(edited, events).differences
    assert difference.what == "a goal that only B has, with 7 events"
    assert difference.subject == "goal gen1 of class FIRST"
    (difference,) = compare(events, edited, Order.PARTIAL).differences
    assert difference.what == "a goal that only A has"


def test_inserted_skill_does_not_shift_message_ids() -> None:
    """Without the correction, all later message ids would differ."""
    events = [
        skill(name, status, msgid)
        for msgid, name in enumerate("abcd", 2)
        for status in ("S_RUNNING", "S_FINAL")
    ]
    edited = [
        replace(event, msgid=event.msgid + (at > 3))
        for at, event in enumerate(events)
        if isinstance(event, SkillStatus)
    ]
    inserted: list[Event] = [*edited[:4], skill("x", "S_RUNNING", 4), skill("x", "S_FINAL", 4), *edited[4:]]
    (difference,) = compare(events, inserted, view=View.SKILLS).differences
    assert (difference.kind, difference.count, difference.b.position) == (DifferenceKind.ONLY_B, 2, 4)


def test_single_other_message_id_is_one_difference() -> None:
    events = [skill("a", "S_RUNNING", 2), *(skill(name, "S_RUNNING", 3) for name in "bcd")]
    edited = [*events[:2], skill("c", "S_RUNNING", 9), events[3]]
    (difference,) = compare(events, edited, view=View.SKILLS).differences
    assert (difference.kind, difference.what) == (DifferenceKind.MSGID, "another message id")


@pytest.mark.parametrize(
    ("changes", "description"),
    [
        ({"outcome": "FAILED"}, "another outcome"),
        ({"mode": "ODD", "error": "X"}, "another mode and error"),
        ({"goal_class": "OTHER"}, "another class"),
        ({"parent": "gen9"}, "another parent"),
    ],
)
def test_difference_names_changed_fields(changes: dict[str, str], description: str) -> None:
    events = two_goals()
    edited = [*events[:4], replace(events[4], **changes), *events[5:]]
    (difference,) = compare(events, edited).differences
    assert (difference.kind, difference.what, difference.position) == (DifferenceKind.CHANGED, description, 4)


def test_equal_goals_are_distinguished_by_earlier_events() -> None:
    """A failure of the other goal is a difference of outcomes, and not an order of goals."""
    events = [goal("gen1", "FORMULATED"), goal("gen2", "FORMULATED")]
    a = [*events, goal("gen1", "FINISHED", "FAILED"), goal("gen2", "FINISHED", "COMPLETED")]
    b = [*events, goal("gen2", "FINISHED", "FAILED"), goal("gen1", "FINISHED", "COMPLETED")]
    comparison = compare(a, b)
    assert comparison.differences[0].position == 2
    assert compare(a, b, Order.PARTIAL).same


def test_early_end_is_one_difference_in_both_orders() -> None:
    events = family()
    total, partial = compare(events, events[:9]), compare(events, events[:9], Order.PARTIAL)
    assert total.differences[0].what == "B ends here, A continues"
    assert total.differences[0].a.position == partial.differences[0].a.position == 9


def test_rules_without_unique_firings_are_aligned() -> None:
    rules = [RuleFired(0, "executive", at, f"rule-{at * at % 23}", "") for at in range(500)]
    edited = [*rules[:100], *rules[103:300], RuleFired(0, "executive", 1, "odd", ""), *rules[300:]]
    comparison = compare(rules, edited, view=View.RULES)
    assert sum(difference.count for difference in comparison.differences) == 4
    assert comparison.differences[0].a.position == 100
