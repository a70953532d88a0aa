"""What of a run is kept for a page."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import (
    Event,
    FactChange,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.report.model import Goal, Limits, parents
from cxbridge.trace.report.reading import FACT_POINTS, read
from tests.trace.events import events
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, action, family, goal, recording

SMALL = Limits(goals=2, actions=1, calls=1, transitions=3, log=2, writes=2, firings=2)


def status(text: str, state: str, msgid: int = 1, time: int = 0) -> SkillStatus:
    return SkillStatus(time, "executive", "Skiller", text, msgid, state)


def calls(*events: Event) -> list[tuple[str, str, bool]]:
    model = read(MemoryRun(events))
    return [(call.skill_string, call.status, call.end is None) for call in model.calls]


def test_a_family_of_goals():
    model = read(MemoryRun(family()))
    assert [each.goal for each in model.goals] == ["gen1", "gen2", "RUN-gen3"]
    assert parents(model.goals) == [2, 2, None]
    assert [state.mode for state in model.goals[1].states] == [
        "FORMULATED",
        "FORMULATED",
        "SELECTED",
        "FINISHED",
    ]
    assert [(each.name, each.goal, len(each.states)) for each in model.actions] == [("say", 0, 3)]
    assert model.events == len(family())


def test_parents_in_a_circle_and_parents_never_seen():
    def make(number: int, name: str, parent: str) -> Goal:
        return Goal(number, "e", name, "C", "nil", parent)

    goals = [make(0, "a", "b"), make(1, "b", "a"), make(2, "c", "a"), make(3, "d", "gone"), make(4, "e", "e")]
    found = parents(goals)
    assert found[3] is None
    assert found[4] is None
    assert sorted([found[0], found[1]], key=str) in ([0, None], [1, None])
    assert found[2] == 0


@given(st.lists(st.integers(0, 7), max_size=8))
def test_every_goal_has_a_root(chosen):
    goals = [
        Goal(number, "e", f"g{number}", "C", "nil", f"g{parent}") for number, parent in enumerate(chosen)
    ]
    found = parents(goals)
    for start in range(len(goals)):
        at, steps = start, 0
        while (up := found[at]) is not None:
            at, steps = up, steps + 1
            assert steps <= len(goals)


def test_a_skill_lasts_from_running_to_its_end():
    assert calls(
        status("", "S_INACTIVE", 0),
        status("a", "S_RUNNING"),
        status("a", "S_RUNNING"),
        status("a", "S_FINAL"),
    ) == [("a", "S_FINAL", False)]


def test_a_skill_that_is_cut_off_is_not_over():
    assert calls(status("a", "S_RUNNING")) == [("a", "S_RUNNING", True)]


def test_a_skill_that_another_one_follows_was_stopped():
    assert calls(status("a", "S_RUNNING"), status("b", "S_RUNNING", 2), status("b", "S_FAILED", 2)) == [
        ("a", "stopped", False),
        ("b", "S_FAILED", False),
    ]


def test_what_a_used_skiller_did_before_is_no_call():
    assert calls(status("old", "S_FINAL"), status("old", "S_FINAL")) == []


def test_a_skill_between_two_looks_is_a_call():
    assert calls(status("", "S_INACTIVE", 0), status("a", "S_FINAL")) == [("a", "S_FINAL", False)]


def test_the_error_of_a_skill_is_in_its_interface():
    write = InterfaceWrite(0, "SkillerInterface::Skiller", {"error": "no way"})
    model = read(MemoryRun([status("a", "S_RUNNING"), write, status("a", "S_FAILED")]))
    assert model.calls[0].error == "no way"


def test_rules_are_counted_with_first_and_last():
    model = read(MemoryRun([RuleFired(time, "e", 1, "r", "f-1") for time in (5, 7, 9)]))
    (rule,) = model.rules
    assert (rule.name, rule.count, rule.first, rule.last) == ("r", 3, (0, 0), (2, 4))
    assert model.firings.items() == [(0, 0, 0), (1, 2, 0), (2, 4, 0)]


def test_of_writes_the_changes_are_kept():
    values = ({"x": 1.5, "on": True}, {"x": 1.5, "on": True}, {"x": 1.5, "on": False})
    model = read(MemoryRun([InterfaceWrite(time, "T::i", value) for time, value in enumerate(values)]))
    assert [row[3] for row in model.changes.items()] == [{"x": "1.5", "on": "true"}, {"on": "false"}]
    (count,) = model.interfaces
    assert (count.writes, count.changes, count.first, count.last) == (3, 2, 0, 2)


def plan(time: int, call: str, status_: str) -> PlannerCall:
    return PlannerCall(time, "e", call, "g", "pyperplan", "d", "(p)", status_, 1500, 3, "no plan")


def test_a_call_of_a_planner_lasts_from_its_start_to_its_answer():
    model = read(
        MemoryRun(
            [plan(0, "1", "started"), plan(3, "1", "found"), plan(4, "", "failed"), plan(5, "2", "started")]
        )
    )
    assert [(each.begin, each.end, each.status) for each in model.spans] == [
        ((0, 0), (1, 3), "found"),
        ((2, 4), (2, 4), "failed"),
        ((3, 5), None, ""),
    ]
    assert model.spans[0].text == "3 actions, 0.002 s of real time: (p)"
    assert model.spans[1].text.startswith("no plan, ")


def test_messages_are_told_with_their_interface():
    message = InterfaceMessage(7, "T::i", "ExecSkillMessage", 4, "me", "queued", {"skill_string": "say{}"})
    model = read(MemoryRun([message]))
    assert [row[3] for row in model.messages.items()] == [
        "ExecSkillMessage 4 queued from me: skill_string=say{}"
    ]
    assert (model.interfaces[0].messages, model.interfaces[0].writes) == (1, 0)


def test_the_curve_of_facts_is_bounded_and_ends_right():
    changes = [FactChange(time, "e", True, time, "t", "(t)") for time in range(3 * FACT_POINTS)]
    model = read(MemoryRun(changes))
    assert len(model.facts) <= FACT_POINTS
    assert model.facts[-1] == (len(changes) - 1, len(changes) - 1, len(changes))


def test_what_is_left_out_is_told():
    lines = [LogLine(0, Level.INFO, "c", str(number)) for number in range(5)]
    writes = [InterfaceWrite(0, "T::i", {"x": number}) for number in range(5)]
    firings = [RuleFired(0, "e", 1, f"r{number}", "") for number in range(5)]
    skills = [status("a", "S_RUNNING"), status("b", "S_RUNNING", 2), status("b", "S_FINAL", 2)]
    actions = [action("gen1", str(number), "FORMULATED") for number in range(2)]
    model = read(MemoryRun([*family(), *actions, *lines, *writes, *firings, *skills]), SMALL)
    text = "\n".join(model.notes)
    assert "3 of 5 log lines of level I" in text
    assert "3 of 5 interface writes" in text
    assert "3 of 5 firings" in text
    assert len(model.rules) == 5
    for what in ("goals beyond", "plan-actions beyond", "calls of skills", "the first and the last of each"):
        assert what in text
    first, second = model.goals
    assert (first.states[0].mode, first.states[-1].outcome) == ("FORMULATED", "COMPLETED")
    assert (second.states[0].mode, second.states[-1].outcome) == ("FORMULATED", "FAILED")


def test_an_empty_run():
    model = read(MemoryRun([]))
    assert (model.events, model.end, model.start_us) == (0, 0, None)


@given(st.lists(events, max_size=30))
def test_any_events_can_be_read(several):
    model = read(MemoryRun(several))
    assert model.events == len(several)
    assert all(at.seq <= model.events for each in model.goals for at in each.states)
    read(MemoryRun(several), SMALL)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs the recordings of Fawkes, shared/traces")
@pytest.mark.parametrize("name", NAMES)
def test_the_recordings_of_fawkes(name):
    model = read(open_run(recording(name)))
    assert len(model.goals) == 20
    assert sum(rule.count for rule in model.rules) == 728
    assert [call.status for call in model.calls] == ["S_FINAL"] * 4
    assert [
        goal_.states[-1].outcome
        for goal_, parent in zip(model.goals, parents(model.goals), strict=True)
        if parent is None
    ] == ["COMPLETED"]


def test_a_goal_that_is_retracted_and_comes_again_is_one_goal():
    model = read(MemoryRun([goal("a", "FORMULATED"), goal("a", "RETRACTED"), goal("a", "FORMULATED")]))
    assert [[state.mode for state in each.states] for each in model.goals] == [
        ["FORMULATED", "RETRACTED", "FORMULATED"]
    ]
