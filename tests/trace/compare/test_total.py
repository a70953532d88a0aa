"""Total order: the same events in the same order, with names by first appearance."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, InterfaceWrite, RuleFired, SkillStatus
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, family, goal, skill


def is_same(
    a: Sequence[Event], b: Sequence[Event], view: View = View.TRANSITIONS, order: Order = Order.TOTAL
) -> bool:
    return compare_runs(MemoryRun(a), [MemoryRun(b)], view, order).same


def fact(text: str, index: int = 1) -> FactChange:
    return FactChange(0, "executive", True, index, text[1:].split(" ", maxsplit=1)[0], text)


@pytest.mark.parametrize(
    ("text_a", "text_b", "expected"),
    [
        ("(goal (id gen3))", "(goal (id gen4))", True),
        ("(goal (id A-gen3))", "(goal (id B-gen3))", False),
        ("(pair gen3 gen4)", "(pair gen3 gen3)", False),
        ("(lock (time 1795225040 51018))", "(lock (time 1000000000 0))", True),
        ("(lock (time 0 0))", "(lock (time 1000000000 0))", False),
        (
            "(wm-fact (values start INTEGER 1795225045 INTEGER 242736))",
            "(wm-fact (values start INTEGER 1795225327 INTEGER 1))",
            True,
        ),
        (
            '(i (serial "e2f76a4a-102e-4518-b222-fd8e48cf1ed1"))',
            '(i (serial "69d32cc9-1a74-41d5-8e6f-e02b47d0613b"))',
            True,
        ),
        ("(map (wm-fact-idx 229))", "(map (wm-fact-idx 4))", True),
        ("(map (wm-fact-idx 229))", "(map (wm-fact-idx 0))", False),
        ("(goal (meta-fact 12))", "(goal (meta-fact 13))", True),
        ("(held <Fact-12>)", "(held <Fact-13>)", True),
        ("(count 12)", "(count 13)", False),
        ("(general 3)", "(general 4)", False),
    ],
)
def test_generated_names_in_facts_are_no_difference(text_a: str, text_b: str, expected: bool) -> None:
    assert is_same([fact(text_a, 1)], [fact(text_b, 7)], View.FACTS) is expected
    assert is_same([fact(text_a, 1)], [fact(text_b, 7)], View.FACTS, Order.PARTIAL) is (
        expected or text_a.startswith("(pair")  # without an order, names cannot be told apart
    )


def test_message_ids_count_from_first_skill_of_each_skiller() -> None:
    first = [skill("", "S_INACTIVE", 0), skill("say{}", "S_RUNNING", 2), skill("go{}", "S_RUNNING", 3)]
    shifted = [skill("", "S_INACTIVE", 0), skill("say{}", "S_RUNNING", 52), skill("go{}", "S_RUNNING", 53)]
    known = [skill("", "S_INACTIVE", 1), *first[1:]]
    assert is_same(first, shifted, View.SKILLS)
    assert not is_same(first, known, View.SKILLS)
    assert is_same(first, known, View.SKILLS, Order.PARTIAL)


def test_order_of_rules_counts_in_total_order_only() -> None:
    first: list[Event] = [RuleFired(0, "executive", 1, "a", "f-1"), RuleFired(0, "executive", 2, "b", "f-2")]
    second = first[::-1]
    assert not is_same(first, second, View.RULES)
    assert is_same(first, second, View.RULES, Order.PARTIAL)
    assert not is_same(first, first[:1], View.RULES, Order.PARTIAL)


def test_writes_are_compared_per_interface_in_partial_order() -> None:
    def write(uid: str, **values: object) -> Event:
        return InterfaceWrite(0, uid, values)

    first = [write("A::1", x=1), write("B::1", x=1), write("A::1", x=2)]
    second = [write("B::1", x=1), write("A::1", x=1), write("A::1", x=1), write("A::1", x=2)]
    assert not is_same(first, second, View.BLACKBOARD)
    assert is_same(first, second, View.BLACKBOARD, Order.PARTIAL)
    assert not is_same(first, second[:-1], View.BLACKBOARD, Order.PARTIAL)


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("view", View)
def test_empty_runs_are_not_same(view: View, order: Order) -> None:
    with pytest.raises(TraceError, match=f"has no events of level {view.value}"):
        compare_runs(MemoryRun([]), [MemoryRun([])], view, order)


def test_comparison_has_index_of_different_run() -> None:
    comparison = compare_runs(
        MemoryRun(family()), [MemoryRun(family()), MemoryRun([goal("gen1", "FORMULATED")])]
    )
    assert comparison.other_index == 1


def test_message_ids_in_facts_count_per_skiller() -> None:
    def facts(first: int, second: int) -> list[Event]:
        return [
            fact(f'(SkillerInterface (id "{name}") (msgid {msgid + at}))')
            for at in range(3)
            for name, msgid in (("Left", first), ("Right", second))
        ]

    assert is_same(facts(2, 5), facts(7, 90), View.FACTS)
    assert not is_same(facts(2, 5), [*facts(7, 90)[:-1], facts(7, 91)[-1]], View.FACTS)


def test_extra_skill_of_one_skiller_keeps_ids_of_another() -> None:
    def status(skiller: str, text: str, msgid: int) -> SkillStatus:
        return SkillStatus(0, "executive", skiller, text, msgid, "S_RUNNING")

    a = [status("Left", "a", 2), status("Right", "a", 2), status("Right", "b", 3)]
    b = [a[0], a[1], status("Left", "x", 3), status("Right", "b", 4)]
    comparison = compare_runs(MemoryRun(a), [MemoryRun(b)], View.SKILLS)
    assert [difference.kind.value for difference in comparison.differences] == ["only-b", "msgid"]
