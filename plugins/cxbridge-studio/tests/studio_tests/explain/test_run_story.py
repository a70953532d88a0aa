"""The story of a run, of a plan-action and of a fact: runs of a few events."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import InterfaceWrite
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from studio_tests.explain.test_goal_story import FAILED, started
from tests.history.runs import ListRun, action, fact, fired, goal, skill, us


def told(events, kind: str, name: str = "", at: float | None = None, **ending: str):
    run = ListRun(events)
    run.metadata = lambda: ending  # type: ignore[method-assign]
    return explain(RecordedEvidence(run, at, None), name, kind)


def test_a_run_that_failed_begins_with_the_reason():
    story = told(FAILED, "run").data
    assert story["headline"] == (
        "top1 (TOP) FAILED at 3.300 s, error: SUB-GOAL-FAILED talk1: talk1 (TALK) FAILED at 3.200 s: "
        'action 10 say failed at 3.100 s: probably skill say{text="hi"} of Skiller ended S_FAILED: no speaker'
    )
    assert [each["text"] for each in story["wanted"]] == ["top1 (TOP), with 1 sub-goal: FAILED"]
    assert story["now"] == []
    assert story["unknown"] == [
        "facts, and why rules did not fire, are unknown: record with --trace-level facts"
    ]


def test_a_run_that_works_names_the_skill():
    story = told(FAILED, "run", at=2.5).data
    assert story["headline"].startswith("top1 (TOP) is under way: Skiller executes say{")
    assert story["wrong"] == []


def test_a_run_that_waits_says_for_what():
    story = told(started(0, "a1"), "run").data
    assert (
        story["headline"]
        == "a1 (A) has been DISPATCHED since 0.000 s, and waits for its actions and sub-goals"
    )
    assert [each["text"] for each in story["wrong"]] == [story["headline"]]


def test_a_recording_of_interfaces_alone_names_what_records_goals():
    events = [InterfaceWrite(us(at), "RobotinoSensorInterface::Robotino", {}) for at in (0, 1)]
    story = told(events, "run").data
    assert story["headline"] == "nothing is known about goals: the recording has no events of an executive"
    assert [text.split(";")[0] for text in story["unknown"]] == [
        "goals and rules: record a run or a daemon with --trace"
    ]
    assert told([*events, *started(2, "a1")], "run", at=1.5).data["headline"] == "no goal has been formulated"


def test_a_moment_after_the_end_is_named():
    events = [*FAILED, fact(3.29999, 5, "(a)")]
    for kind, name in (("run", ""), ("goal", "talk1"), ("action", "talk1/10"), ("fact", "f-5")):
        assert not told(events, kind, name, at=3.3).data["notes"]
        explanation = told(events, kind, name, at=9999)
        assert explanation.lines[-1] == "note: the recording ends at 3.300 s, before --at 9999"
        assert list(explanation.data["notes"]) == ["the recording ends at 3.300 s, before --at 9999"]


def test_how_the_run_ended_is_told():
    story = told(started(0, "a1"), "run", status="3", reason="the timeout passed").data
    assert story["wrong"][0]["text"] == "the run ended with status 3: the timeout passed"


def test_failures_that_were_overcome_are_a_part_of_their_own():
    events = [
        *started(0, "top1"),
        *started(0, "b1", "top1"),
        goal(1, "b1", "FINISHED", "FAILED", parent="top1"),
        goal(2, "top1", "FINISHED", "COMPLETED"),
    ]
    story = told(events, "run").data
    assert story["headline"] == "top1 (TOP) COMPLETED at 2.000 s"
    assert story["overcome"] == [{"text": "b1 (B) FAILED at 1.000 s", "because": []}]


def test_of_many_goals_the_first_are_told():
    events = [event for number in range(20) for event in (goal(0, f"a{number}", "FORMULATED"),)]
    story = told(events, "run")
    assert len(story.data["wanted"]) == 12
    assert story.data["wanted"][-1]["text"] == "and 9 more"
    assert "  and 9 more" in story.lines


def test_an_action_answers_why():
    failed = told(FAILED, "action", "talk1/10").data
    assert failed["headline"].endswith("ended S_FAILED: no speaker")
    assert [moment["text"] for moment in failed["actions"][0]["moments"]][-1] == "FAILED"
    waiting = told([*started(0, "a1"), action(1, "a1", 2, "go", "PENDING")], "action", "a1/go").data
    assert waiting["headline"].startswith("action 2 go has been PENDING since 1.000 s")
    with pytest.raises(CxbridgeError, match="no plan-action 'a1/3'"):
        told(started(0, "a1"), "action", "a1/3")


def test_a_fact_names_the_rules_that_asserted_and_retracted_it():
    events = [
        fact(0, 4, "(note (n 1))"),
        fired(1, "count"),
        fact(1, 4, "(note (n 1))", asserted=False),
        fact(1, 5, "(note (n 2))"),
        fired(2, "forget"),
        fact(2, 5, "(note (n 2))", asserted=False),
        skill(3, "x{}", "S_RUNNING"),
    ]
    story = told(events, "fact", "f-5")
    assert (
        story.data["headline"] == "f-5 was asserted at 1.000 s, instead of f-4: rule count fired just before"
    )
    assert story.lines[-1] == "it was retracted at 2.000 s: rule forget fired just before"
    assert "no rule is known" in told(events, "fact", "4").lines[0]
    with pytest.raises(CxbridgeError, match="no fact f-9"):
        told(events, "fact", "f-9")
    with pytest.raises(CxbridgeError) as caught:
        told(started(0, "a1"), "fact", "f-1")
    assert caught.value.hint == "record with --trace-level facts"
