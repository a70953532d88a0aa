"""The events of a run after --only and --ignore."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, InterfaceWrite, RuleFired
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.compare.selection import Selection, parse_pattern
from tests.trace.runs import MemoryRun, action, family, goal, skill


def selected_indices(
    events: Sequence[Event], only: Sequence[str] = (), ignore: Sequence[str] = ()
) -> list[int]:
    """Return the indices of the selected events."""
    take = Selection(only, ignore).content_selector()
    return [at for at, event in enumerate(events) if take(event) is not None]


EVENTS: list[Event] = [
    goal("gen1", "FORMULATED", goal_class="TESTGOAL"),
    action("gen1", "1", "PENDING"),
    goal("gen2", "FORMULATED", goal_class="OTHER", parent="gen1"),
    action("gen2", "1", "PENDING", "print"),
    skill('say{text="a, b", wait=true}', "S_RUNNING", 3),
    RuleFired(0, "executive", 1, "test-print", "f-1"),
    RuleFired(0, "other", 2, "test-say", "f-1"),
    FactChange(0, "executive", True, 7, "time", "(time 1 2)"),
    InterfaceWrite(0, "SkillerInterface::Skiller", {"msgid": 3, "status": 1}),
    InterfaceWrite(0, "Position::/robot.base", {"x": 1.0}),
    goal("gen1", "RETRACTED", goal_class="TESTGOAL"),
]


@pytest.mark.parametrize(
    ("pattern", "matched"),
    [
        ("goal", [0, 1, 2, 3, 10]),
        ("goal:gen1", [0, 1, 10]),
        ("goal:class=TEST*", [0, 1, 10]),
        ("goal:class=test*", []),
        ("goal:class=TEST*,mode=RETRACTED", [10]),
        ("goal:mode=FORM*", [0, 2]),
        ("goal:parent=gen1", [2]),
        ("goal:env=executive", [0, 1, 2, 3, 10]),
        ("plan-action:say", [1]),
        ("plan-action:goal=gen2,state=PENDING", [3]),
        ("plan-action:class=TESTGOAL", [1]),
        ("skill:say{*}", [4]),
        ('skill:string=say{text="a, b"*,status=S_RUNNING', [4]),
        ("skill:status=S_FINAL", []),
        ("rule:*-print", [5]),
        ("rule:env=other", [6]),
        ("fact:time", [7]),
        ("fact:text=(time*2)", [7]),
        ("interface:SkillerInterface::*", [8]),
        ("interface:uid=Position::/robot.base", [9]),
    ],
)
def test_pattern_selects_matching_events(pattern: str, matched: list[int]) -> None:
    assert selected_indices(EVENTS, only=[pattern]) == matched
    assert selected_indices(EVENTS, ignore=[pattern]) == [
        at for at in range(len(EVENTS)) if at not in matched
    ]


def test_event_that_matches_only_and_no_ignore_is_selected() -> None:
    assert selected_indices(
        EVENTS, ["goal:class=TEST*", "skill"], ["goal:mode=RETRACTED", "plan-action"]
    ) == [0, 4]


@pytest.mark.parametrize(
    ("pattern", "event", "expected"),
    [
        ("skill.msgid", skill("a", "S_FINAL", 7), skill("a", "S_FINAL", 0)),
        ("goal.error:class=WORK", goal("g", "FINISHED", error="X"), goal("g", "FINISHED")),
        ("interface.msg*:Skiller*", EVENTS[8], InterfaceWrite(0, "SkillerInterface::Skiller", {"status": 1})),
        ("interface.status", EVENTS[8], InterfaceWrite(0, "SkillerInterface::Skiller", {"msgid": 3})),
        (
            "fact.b:t",
            FactChange(0, "e", True, 1, "t", '(t (a 1) (b "x y") (c))'),
            FactChange(0, "e", True, 1, "t", "(t (a 1) (c ))"),
        ),
        ("fact.b:t", FactChange(0, "e", True, 1, "t", "(t 1 2"), FactChange(0, "e", True, 1, "t", "(t 1 2")),
    ],
)
def test_field_can_be_ignored(pattern: str, event: Event, expected: Event) -> None:
    assert Selection(ignore=[pattern]).content_selector()(event) == expected


def test_event_that_differs_in_ignored_field_only_is_ignored() -> None:
    beats: list[Event] = [InterfaceWrite(at, "A::1", {"beat": at, "x": at // 3}) for at in range(6)]
    assert selected_indices(beats, ignore=["interface.beat:A::1"]) == [0, 3]
    errors = [goal("g", "FINISHED", "FAILED", error=error) for error in ("", "X", "Y")]
    assert selected_indices(errors, ignore=["goal.error"]) == [0]
    repeated = [errors[0], goal("h", "FINISHED", "FAILED"), errors[1]]
    assert selected_indices(repeated, ignore=["goal.error"]) == [0, 1]


@pytest.mark.parametrize("order", Order)
def test_runs_with_ignored_differences_are_same(order: Order) -> None:
    events = family()
    edited = [*events[:-1], goal("RUN-gen3", "FINISHED", "FAILED", goal_class="PARENT", error="ODD")]

    def is_same(**patterns: list[str]) -> bool:
        selection = Selection(**patterns)
        return compare_runs(MemoryRun(events), [MemoryRun(edited)], order=order, selection=selection).same

    assert not is_same(ignore=["goal:class=WORK"])
    assert not is_same(only=["goal:class=PARENT"])
    assert is_same(ignore=["goal:class=PARENT"])
    assert is_same(ignore=["goal.error"])
    assert is_same(only=["goal:class=WORK", "skill"])
    assert is_same(ignore=["goal:outcome=FAILED,class=PARENT"])


def test_numbers_of_difference_count_selected_events() -> None:
    events = family()
    edited = [*events[:12], skill("odd{}", "S_RUNNING"), *events[13:]]
    for order in Order:
        comparison = compare_runs(
            MemoryRun(events), [MemoryRun(edited)], order=order, selection=Selection(only=["skill"])
        )
        assert (comparison.count_a, comparison.differences[0].a.position) == (2, 0)


def test_unused_patterns_are_listed() -> None:
    selection = Selection(only=["goal", "rule:x"], ignore=["goal:gen7"])
    compare_runs(MemoryRun(family()), [MemoryRun(family())], selection=selection)
    assert selection.unused_patterns == ["rule:x", "goal:gen7"]


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ("goals:x", "unknown kind 'goals'"),
        ("", "unknown kind ''"),
        ("goal:colour=red", "unknown field 'colour'"),
        ("goal.colour", "goal has no field 'colour' to leave out"),
        ("plan-action.class", "plan-action has no field 'class' to leave out"),
    ],
)
def test_invalid_pattern_is_refused(pattern: str, message: str) -> None:
    with pytest.raises(TraceError, match=message) as caught:
        parse_pattern(pattern)
    assert (caught.value.hint or "").startswith("use one of ")


def test_only_selects_whole_events_of_level() -> None:
    with pytest.raises(TraceError, match="single fields can only be ignored"):
        Selection(only=["goal.error"])
    with pytest.raises(TraceError, match="has no events of level skills") as caught:
        compare_runs(MemoryRun(EVENTS), [MemoryRun(EVENTS)], View.SKILLS, selection=Selection(["goal"]))
    assert "--only" in (caught.value.hint or "")
