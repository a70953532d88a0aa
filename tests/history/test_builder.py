"""The history that a run's events tell."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import Event, FactChange, InterfaceWrite, PlannerCall, SkillStatus
from cxbridge.history.builder import HistoryLimits, RunHistory
from cxbridge.history.model import GoalChange, GoalRecord, goal_forest
from cxbridge.trace.formats.registry import open_run
from tests.trace.runs import NAMES, RECORDINGS, family, goal, recording


def record(number: int, name: str, parent: str) -> GoalRecord:
    change = GoalChange(number, 0, "FORMULATED", "UNKNOWN", "", parent)
    return GoalRecord(number, "e", name, "C", "nil", [change])


def status(text: str, state: str, msgid: int = 1, time: int = 0) -> SkillStatus:
    return SkillStatus(time, "executive", "Skiller", text, msgid, state)


def calls(*events: Event) -> list[tuple[str, str, bool]]:
    return [
        (call.skill_string, call.status, call.end is None) for call in RunHistory.from_events(events).calls
    ]


def test_a_family_of_goals():
    history = RunHistory.from_events(family())
    assert [each.id for each in history.goals] == ["gen1", "gen2", "RUN-gen3"]
    assert list(goal_forest(history.goals).parents.values()) == [2, 2, None]
    assert [change.mode for change in history.goals[1].changes] == [
        "FORMULATED",
        "FORMULATED",
        "SELECTED",
        "FINISHED",
    ]
    (say,) = history.actions
    assert (say.name, say.goal_record, len(say.changes)) == ("say", history.goals[0], 3)
    assert history.event_count == len(family())


def test_parents_in_a_circle_and_parents_never_seen():
    goals = [
        record(0, "a", "b"),
        record(1, "b", "a"),
        record(2, "c", "a"),
        record(3, "d", "gone"),
        record(4, "e", "e"),
    ]
    found = goal_forest(goals).parents
    assert found[3] is None
    assert found[4] is None
    assert sorted([found[0], found[1]], key=str) in ([0, None], [1, None])
    assert found[2] == 0


@given(st.lists(st.integers(0, 7), max_size=8))
def test_every_goal_has_a_root(chosen):
    goals = [record(number, f"g{number}", f"g{parent}") for number, parent in enumerate(chosen)]
    found = goal_forest(goals).parents
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
    history = RunHistory.from_events([status("a", "S_RUNNING"), write, status("a", "S_FAILED")])
    assert history.calls[0].error == "no way"


def plan(time: int, call: str, status_: str) -> PlannerCall:
    return PlannerCall(time, "e", call, "g", "pyperplan", "d", "(p)", status_, 1500, 3, "no plan")


def test_a_call_of_a_planner_lasts_from_its_start_to_its_answer():
    history = RunHistory.from_events(
        [plan(0, "1", "started"), plan(3, "1", "found"), plan(4, "", "failed"), plan(5, "2", "started")]
    )
    assert [(each.begin, each.end, each.status) for each in history.planner_calls] == [
        ((0, 0), (1, 3), "found"),
        ((2, 4), (2, 4), "failed"),
        ((3, 5), None, ""),
    ]
    assert history.planner_calls[0].text == "3 actions, 0.002 s of real time: (p)"
    assert history.planner_calls[1].text.startswith("no plan, ")


def test_a_goal_that_is_retracted_and_comes_again_is_one_goal():
    history = RunHistory.from_events(
        [goal("a", "FORMULATED"), goal("a", "RETRACTED"), goal("a", "FORMULATED")]
    )
    assert [[change.mode for change in each.changes] for each in history.goals] == [
        ["FORMULATED", "RETRACTED", "FORMULATED"]
    ]


def test_it_can_be_read_between_two_events():
    history = RunHistory()
    seen = []
    for event in family():
        history.record_event(event)
        seen.append((history.event_count, [each.mode for each in history.goals]))
    assert [count for count, _ in seen] == list(range(1, len(family()) + 1))
    assert seen[0][1] == ["FORMULATED"]
    assert seen[-1][1] == ["FINISHED", "FINISHED", "FINISHED"]


def test_a_skill_string_that_is_cut_is_still_one_skill():
    """It was `stopped`, and began again with each status: the cut text was compared with the whole."""
    text = f'say{{text="{"x" * 3000}"}}'
    found = calls(status(text, "S_RUNNING"), status(text, "S_RUNNING"), status(text, "S_FINAL"))
    assert [found_status for _, found_status, _ in found] == ["S_FINAL"]
    assert len(found[0][0]) < len(text)


def test_the_error_of_a_skill_is_in_the_fact_that_the_executive_has_of_it():
    text = '(SkillerInterface (id "Skiller") (skill_string "a") (error "no way") (msgid 1) (status S_FAILED))'
    fact = FactChange(1, "executive", True, 7, "SkillerInterface", text)
    history = RunHistory.from_events([status("a", "S_RUNNING"), fact, status("a", "S_FAILED", time=1)])
    assert history.calls[0].error == "no way"


def test_times_are_since_the_begin_of_the_run():
    history = RunHistory(start_us=1_000_000)
    history.record_event(status("a", "S_RUNNING", time=3_500_000))
    assert history.calls[0].begin == (0, 2_500_000)


def write(skiller: str, text: str, state: str, msgid: int, time: int, error: str = "") -> InterfaceWrite:
    values = {"skill_string": text, "status": state, "msgid": msgid, "error": error}
    return InterfaceWrite(time, f"SkillerInterface::{skiller}", values)


def test_a_skiller_that_no_executive_reads_has_its_calls():
    history = RunHistory.from_events(
        [
            write("r1/S", "", "S_INACTIVE", 0, 0),
            write("r1/S", "a", "S_RUNNING", 1, 10),
            write("r1/S", "a", "S_FAILED", 1, 20, "blocked"),
        ]
    )
    (call,) = history.calls
    assert (call.env, call.skiller, call.status, call.error) == ("r1", "S", "S_FAILED", "blocked")
    assert (call.begin[1], call.end and call.end[1]) == (10, 20)


def test_what_an_executive_reads_counts():
    history = RunHistory.from_events(
        [
            write("Skiller", "a", "S_RUNNING", 1, 0),
            status("a", "S_RUNNING", time=10),
            write("Skiller", "a", "S_FINAL", 1, 20),
            status("a", "S_FINAL", time=30),
        ]
    )
    (call,) = history.calls
    assert (call.env, call.begin[1], call.end and call.end[1]) == ("executive", 10, 30)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs the recordings of Fawkes, shared/traces")
@pytest.mark.parametrize("name", NAMES)
def test_the_recordings_of_fawkes_have_their_goals_and_skills(name):
    history = RunHistory.from_events(open_run(recording(name)))
    goals = history.goals
    assert len(goals) == 20
    assert [call.status for call in history.calls] == ["S_FINAL"] * 4
    assert [goals[number].outcome for number in goal_forest(goals).roots] == ["COMPLETED"]


def test_a_history_keeps_the_first_goals_and_the_first_and_last_transitions():
    limits = HistoryLimits(goals=2, actions=1, calls=1, transitions=3)
    history = RunHistory.from_events(
        [*family(), status("a", "S_RUNNING", 1), status("b", "S_RUNNING", 2)], limits
    )
    first, second = history.goals
    assert (first.changes[0].mode, first.changes[-1].outcome) == ("FORMULATED", "COMPLETED")
    assert (second.changes[0].mode, second.changes[-1].outcome) == ("FORMULATED", "FAILED")
    assert (len(history.actions), len(history.calls)) == (1, 1)
