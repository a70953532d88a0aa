"""Total order: the same events in the same order, names by first appearance."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, InterfaceWrite, RuleFired, SkillStatus
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from tests.trace.runs import MemoryRun, family, goal, skill


def same(
    a: Sequence[Event], b: Sequence[Event], view: View = View.TRANSITIONS, order: Order = Order.TOTAL
) -> bool:
    return compare_runs(MemoryRun(a), [MemoryRun(b)], view, order).same


def fact(text: str, index: int = 1) -> FactChange:
    return FactChange(0, "executive", True, index, text[1:].split(" ", maxsplit=1)[0], text)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
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
def test_names_in_facts(one: str, other: str, expected: bool) -> None:
    assert same([fact(one, 1)], [fact(other, 7)], View.FACTS) is expected
    assert same([fact(one, 1)], [fact(other, 7)], View.FACTS, Order.PARTIAL) is (
        expected or one.startswith("(pair")  # who is who cannot be told without an order
    )


def test_message_ids_count_from_the_first_skill_of_each_skiller() -> None:
    one = [skill("", "S_INACTIVE", 0), skill("say{}", "S_RUNNING", 2), skill("go{}", "S_RUNNING", 3)]
    shifted = [skill("", "S_INACTIVE", 0), skill("say{}", "S_RUNNING", 52), skill("go{}", "S_RUNNING", 53)]
    known = [skill("", "S_INACTIVE", 1), *one[1:]]
    assert same(one, shifted, View.SKILLS)
    assert not same(one, known, View.SKILLS)
    assert same(one, known, View.SKILLS, Order.PARTIAL)


def test_rules_in_another_order_are_the_same_in_partial_order_only() -> None:
    one: list[Event] = [RuleFired(0, "executive", 1, "a", "f-1"), RuleFired(0, "executive", 2, "b", "f-2")]
    other = one[::-1]
    assert not same(one, other, View.RULES)
    assert same(one, other, View.RULES, Order.PARTIAL)
    assert not same(one, one[:1], View.RULES, Order.PARTIAL)


def test_interface_writes_are_compared_by_interface_in_partial_order() -> None:
    def write(uid: str, **values: object) -> Event:
        return InterfaceWrite(0, uid, values)

    one = [write("A::1", x=1), write("B::1", x=1), write("A::1", x=2)]
    other = [write("B::1", x=1), write("A::1", x=1), write("A::1", x=1), write("A::1", x=2)]
    assert not same(one, other, View.BLACKBOARD)
    assert same(one, other, View.BLACKBOARD, Order.PARTIAL)
    assert not same(one, other[:-1], View.BLACKBOARD, Order.PARTIAL)


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("view", View)
def test_nothing_is_not_the_same_as_nothing(view: View, order: Order) -> None:
    with pytest.raises(TraceError, match=f"has no events of level {view.value}"):
        compare_runs(MemoryRun([]), [MemoryRun([])], view, order)


def test_the_run_that_differs_is_told() -> None:
    comparison = compare_runs(
        MemoryRun(family()), [MemoryRun(family()), MemoryRun([goal("gen1", "FORMULATED")])]
    )
    assert comparison.other_index == 1


def test_message_ids_count_by_skiller_also_in_facts() -> None:
    def facts(first: int, second: int) -> list[Event]:
        return [
            fact(f'(SkillerInterface (id "{name}") (msgid {msgid + at}))')
            for at in range(3)
            for name, msgid in (("Left", first), ("Right", second))
        ]

    assert same(facts(2, 5), facts(7, 90), View.FACTS)
    assert not same(facts(2, 5), [*facts(7, 90)[:-1], facts(7, 91)[-1]], View.FACTS)


def test_what_one_skiller_did_more_does_not_hide_the_ids_of_another() -> None:
    def status(skiller: str, text: str, msgid: int) -> SkillStatus:
        return SkillStatus(0, "executive", skiller, text, msgid, "S_RUNNING")

    a = [status("Left", "a", 2), status("Right", "a", 2), status("Right", "b", 3)]
    b = [a[0], a[1], status("Left", "x", 3), status("Right", "b", 4)]
    comparison = compare_runs(MemoryRun(a), [MemoryRun(b)], View.SKILLS)
    assert [difference.kind.value for difference in comparison.differences] == ["only-b", "msgid"]
