"""The history of a run from its events."""

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


def test_family_of_goals_has_forest_and_changes():
    history = RunHistory.from_events(family())
    assert [goal.id for goal in history.goals] == ["gen1", "gen2", "RUN-gen3"]
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


def test_parents_in_circle_or_missing_make_roots():
    goals = [
        record(0, "a", "b"),
        record(1, "b", "a"),
        record(2, "c", "a"),
        record(3, "d", "gone"),
        record(4, "e", "e"),
    ]
    parents = goal_forest(goals).parents
    assert parents[3] is None
    assert parents[4] is None
    assert sorted([parents[0], parents[1]], key=str) in ([0, None], [1, None])
    assert parents[2] == 0


@given(st.lists(st.integers(0, 7), max_size=8))
def test_every_goal_has_root(chosen):
    goals = [record(number, f"g{number}", f"g{parent}") for number, parent in enumerate(chosen)]
    parents = goal_forest(goals).parents
    for start in range(len(goals)):
        at, steps = start, 0
        while (up := parents[at]) is not None:
            at, steps = up, steps + 1
            assert steps <= len(goals)


def test_call_lasts_from_running_to_end():
    assert calls(
        status("", "S_INACTIVE", 0),
        status("a", "S_RUNNING"),
        status("a", "S_RUNNING"),
        status("a", "S_FINAL"),
    ) == [("a", "S_FINAL", False)]


def test_call_without_end_is_running():
    assert calls(status("a", "S_RUNNING")) == [("a", "S_RUNNING", True)]


def test_next_skill_stops_running_call():
    assert calls(status("a", "S_RUNNING"), status("b", "S_RUNNING", 2), status("b", "S_FAILED", 2)) == [
        ("a", "stopped", False),
        ("b", "S_FAILED", False),
    ]


def test_end_of_earlier_skill_is_no_call():
    assert calls(status("old", "S_FINAL"), status("old", "S_FINAL")) == []


def test_final_status_alone_is_call():
    assert calls(status("", "S_INACTIVE", 0), status("a", "S_FINAL")) == [("a", "S_FINAL", False)]


def test_call_has_error_of_interface():
    write = InterfaceWrite(0, "SkillerInterface::Skiller", {"error": "no way"})
    history = RunHistory.from_events([status("a", "S_RUNNING"), write, status("a", "S_FAILED")])
    assert history.calls[0].error == "no way"


def plan(time: int, call: str, status_: str) -> PlannerCall:
    return PlannerCall(time, "e", call, "g", "pyperplan", "d", "(p)", status_, 1500, 3, "no plan")


def test_planner_call_lasts_from_start_to_result():
    history = RunHistory.from_events(
        [plan(0, "1", "started"), plan(3, "1", "found"), plan(4, "", "failed"), plan(5, "2", "started")]
    )
    assert [(call.begin, call.end, call.status) for call in history.planner_calls] == [
        ((0, 0), (1, 3), "found"),
        ((2, 4), (2, 4), "failed"),
        ((3, 5), None, ""),
    ]
    assert history.planner_calls[0].text == "3 actions, 0.002 s of real time: (p)"
    assert history.planner_calls[1].text.startswith("no plan, ")


def test_goal_retracted_and_asserted_again_is_same_goal():
    history = RunHistory.from_events(
        [goal("a", "FORMULATED"), goal("a", "RETRACTED"), goal("a", "FORMULATED")]
    )
    assert [[change.mode for change in record.changes] for record in history.goals] == [
        ["FORMULATED", "RETRACTED", "FORMULATED"]
    ]


def test_history_is_readable_after_each_event():
    history = RunHistory()
    snapshots = []
    for event in family():
        history.record_event(event)
        snapshots.append((history.event_count, [record.mode for record in history.goals]))
    assert [count for count, _ in snapshots] == list(range(1, len(family()) + 1))
    assert snapshots[0][1] == ["FORMULATED"]
    assert snapshots[-1][1] == ["FINISHED", "FINISHED", "FINISHED"]


def test_truncated_skill_string_is_single_call():
    """A comparison of the cut text with the whole text made a call of each status."""
    text = f'say{{text="{"x" * 3000}"}}'
    skill_calls = calls(status(text, "S_RUNNING"), status(text, "S_RUNNING"), status(text, "S_FINAL"))
    assert [found_status for _, found_status, _ in skill_calls] == ["S_FINAL"]
    assert len(skill_calls[0][0]) < len(text)


def test_call_has_error_of_skiller_fact():
    text = '(SkillerInterface (id "Skiller") (skill_string "a") (error "no way") (msgid 1) (status S_FAILED))'
    fact = FactChange(1, "executive", True, 7, "SkillerInterface", text)
    history = RunHistory.from_events([status("a", "S_RUNNING"), fact, status("a", "S_FAILED", time=1)])
    assert history.calls[0].error == "no way"


def test_times_are_relative_to_start_of_run():
    history = RunHistory(start_us=1_000_000)
    history.record_event(status("a", "S_RUNNING", time=3_500_000))
    assert history.calls[0].begin == (0, 2_500_000)


def write(skiller: str, text: str, state: str, msgid: int, time: int, error: str = "") -> InterfaceWrite:
    values = {"skill_string": text, "status": state, "msgid": msgid, "error": error}
    return InterfaceWrite(time, f"SkillerInterface::{skiller}", values)


def test_skiller_without_executive_has_calls():
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


def test_status_of_executive_has_precedence_over_writes():
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
def test_fawkes_recordings_have_goals_and_skills(name):
    history = RunHistory.from_events(open_run(recording(name)))
    goals = history.goals
    assert len(goals) == 20
    assert [call.status for call in history.calls] == ["S_FINAL"] * 4
    assert [goals[number].outcome for number in goal_forest(goals).roots] == ["COMPLETED"]


def test_limited_history_has_first_goals_and_outer_transitions():
    limits = HistoryLimits(max_goals=2, max_actions=1, max_calls=1, max_transitions=3)
    history = RunHistory.from_events(
        [*family(), status("a", "S_RUNNING", 1), status("b", "S_RUNNING", 2)], limits
    )
    first, second = history.goals
    assert (first.changes[0].mode, first.changes[-1].outcome) == ("FORMULATED", "COMPLETED")
    assert (second.changes[0].mode, second.changes[-1].outcome) == ("FORMULATED", "FAILED")
    assert (len(history.actions), len(history.calls)) == (1, 1)
