"""Explanations of runs, of plan-actions and of facts."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import InterfaceWrite, PlanActionTransition
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from studio_tests.explain.test_goal_story import FAILED, start_goal
from tests.history.runs import ENV, ListRun, action, fact, fired, goal, skill, us


def explain_events(events, kind: str, name: str = "", at: float | None = None, texts=None, **ending: str):
    run = ListRun(events, texts)
    run.metadata = lambda: ending  # type: ignore[method-assign]
    return explain(RecordedEvidence(run, at, None), name, kind)


def test_headline_of_failed_run_is_the_reason():
    story = explain_events(FAILED, "run").json_report
    assert story["headline"] == (
        "top1 (TOP) FAILED at 3.300 s, error: SUB-GOAL-FAILED talk1: talk1 (TALK) FAILED at 3.200 s: "
        'action 10 say failed at 3.100 s: probably skill say{text="hi"} of Skiller ended S_FAILED: no speaker'
    )
    assert [entry["text"] for entry in story["wanted"]] == ["top1 (TOP), with 1 sub-goal: FAILED"]
    assert story["now"] == []
    assert story["unknown"] == [
        "facts, and why rules did not fire, are unknown: record with --trace-level facts"
    ]


def test_headline_of_active_run_names_skill():
    story = explain_events(FAILED, "run", at=2.5).json_report
    assert story["headline"].startswith("top1 (TOP) is under way: Skiller executes say{")
    assert story["wrong"] == []


def test_headline_of_waiting_run_names_open_goal():
    story = explain_events(start_goal(0, "a1"), "run").json_report
    assert (
        story["headline"]
        == "a1 (A) has been DISPATCHED since 0.000 s, and waits for its actions and sub-goals"
    )
    assert [entry["text"] for entry in story["wrong"]] == [story["headline"]]


def test_recording_without_goals_names_option_that_records_goals():
    events = [InterfaceWrite(us(at), "RobotinoSensorInterface::Robotino", {}) for at in (0, 1)]
    story = explain_events(events, "run").json_report
    assert story["headline"] == "nothing is known about goals: the recording has no events of an executive"
    assert [text.split(";")[0] for text in story["unknown"]] == [
        "goals and rules: record a run or a daemon with --trace"
    ]
    assert (
        explain_events([*events, *start_goal(2, "a1")], "run", at=1.5).json_report["headline"]
        == "no goal has been formulated"
    )


def test_time_after_end_of_recording_has_note():
    events = [*FAILED, fact(3.29999, 5, "(a)")]
    for kind, name in (("run", ""), ("goal", "talk1"), ("action", "talk1/10"), ("fact", "f-5")):
        assert not explain_events(events, kind, name, at=3.3).json_report["notes"]
        explanation = explain_events(events, kind, name, at=9999)
        assert explanation.lines[-1] == "note: the recording ends at 3.300 s, before --at 9999"
        assert list(explanation.json_report["notes"]) == ["the recording ends at 3.300 s, before --at 9999"]


def test_end_by_time_limit_names_open_goals():
    story = explain_events(
        start_goal(0, "a1"), "run", status="3", reason="not over: a1 is DISPATCHED after 120 s"
    ).json_report
    assert (
        story["wrong"][0]["text"]
        == "the time limit of 120 s ended the run, and goals are open: a1 is DISPATCHED"
    )


RULES = {
    "agent.clp": """
(deftemplate goal (slot id) (slot class) (slot mode))
(deftemplate robot (slot name) (slot goal))
(defrule plan ?g <- (goal (id ?id) (class B) (mode SELECTED)) (robot (goal ?id))
  => (modify ?g (mode EXPANDED)))
(defrule choose (goal (id ?id) (mode SELECTED)) ?r <- (robot (goal nil)) => (modify ?r (goal ?id)))
"""
}
FACTS = [
    fact(0, 1, "(goal (id b1) (class B) (mode SELECTED))"),
    *(fact(0, index, f"(goal (id {name}) (mode DISPATCHED))") for index, name in ((20, "top1"), (21, "d1"))),
    fact(0, 2, "(goal (id c1) (class C) (mode RETRACTED))"),
    fact(0, 3, "(robot (name r1) (goal c1))"),
]
WAITING = [*start_goal(0, "top1"), *start_goal(0, "b1", "top1", modes=("FORMULATED", "SELECTED"))]
WAITS = (
    "b1 (B) has been SELECTED since 0.000 s: "
    "rule plan has not fired: condition 2 (robot (goal ?id)) has no match: goal is c1 in f-3, wanted b1: "
    "rule choose has not fired: condition 2 ?r <- (robot (goal nil)) has no match: "
    "goal is c1 in f-3, wanted nil"
)


def test_waiting_goal_names_rules_for_missing_fact():
    done = [*start_goal(0, "c1"), goal(0, "c1", "RETRACTED", "COMPLETED")]
    by_planner = RULES["agent.clp"].replace("(modify ?g (mode EXPANDED))", '(planner-plan ?id "(done)")')
    assert all(
        explain_events([*WAITING, *FACTS], "run", texts={"agent.clp": text}).lines[0].startswith(WAITS)
        for text in (by_planner, by_planner.replace("?g <- ", ""))
    )
    story = explain_events([*done, *WAITING, *FACTS], "run", texts=RULES)
    assert (
        story.json_report["headline"]
        == f"{WAITS}: no other rule sets the slot goal of robot to nil in its own actions"
    )
    assert ": c1 (C) COMPLETED at 0.000 s" in "\n".join(story.lines)
    rule = "(defrule free (gone (name ?name)) ?r <- (robot (name ?name)) => (modify ?r (goal nil)))"
    texts = {"agent.clp": f"{RULES['agent.clp']}(deftemplate gone (slot name)){rule}"}
    assert explain_events([*WAITING, *FACTS], "run", texts=texts).json_report["headline"] == (
        f"{WAITS}: rule free has not fired: condition 1 (gone (name ?name)) has no match: "
        "there is no fact of 'gone'"
    )


DOMAIN = [
    fact(0, 10, "(domain-operator (name look) (param-names r p))"),
    fact(0, 11, "(pddl-formula (id look1) (part-of look) (type atom))"),
    fact(
        0,
        12,
        "(pddl-predicate (id a) (part-of look1) (predicate at) (param-names r p) (param-constants nil nil))",
    ),
    fact(
        0,
        13,
        "(plan-action (id 2) (goal-id d1) (plan-id d1-PLAN) (action-name look) (state PENDING)"
        " (param-names r p) (param-values r1 dock) (executable FALSE))",
    ),
]


def test_blocked_action_comes_before_waiting_goals():
    atom = "(domain-fact (name at) (param-values r1 dock))"
    blocked = [
        fired(0, "plan-moves"),
        *start_goal(0, "d1", "top1"),
        PlanActionTransition(us(1), ENV, "1", "d1", "d1-PLAN", "move", "FORMULATED", "(r1 dock lab)"),
        PlanActionTransition(us(1), ENV, "2", "d1", "d1-PLAN", "look", "FORMULATED", "(r1 dock)"),
        fact(1, 4, atom),
        fact(2, 4, atom, asserted=False),
        PlanActionTransition(us(2), ENV, "1", "d1", "d1-PLAN", "move", "EFFECTS-APPLIED", "(r1 dock lab)"),
        PlanActionTransition(us(2), ENV, "1", "d1", "d1-PLAN", "move", "FINAL", "(r1 dock lab)"),
        PlanActionTransition(us(2), ENV, "2", "d1", "d1-PLAN", "look", "PENDING", "(r1 dock)"),
        *DOMAIN,
    ]
    story = explain_events([*WAITING, *FACTS, *blocked], "run", texts=RULES).json_report
    assert story["headline"] == (
        "action 2 look(r1 dock) of d1 has been PENDING since 2.000 s: its precondition does not hold: "
        "(at r1 dock) is false, made false at 2.000 s by the effect of action 1 move(r1 dock lab) of d1"
    )
    first, second = story["wrong"][0]["because"]
    assert first["text"].startswith("d1 (D)")
    assert first["because"][0]["because"][1]["text"] == "rule plan-moves made the plan at 0.000 s"
    assert second["because"][0]["text"].startswith("rule plan has not fired")


def test_overcome_failures_are_in_separate_part():
    events = [
        *start_goal(0, "top1"),
        *start_goal(0, "b1", "top1"),
        goal(1, "b1", "FINISHED", "FAILED", parent="top1"),
        # a sub-goal that is formulated again after it has completed has not failed
        *start_goal(0, "c1", "top1"),
        goal(1, "c1", "FINISHED", "COMPLETED", parent="top1"),
        goal(1.5, "c1", "FORMULATED", parent="top1"),
        goal(2, "top1", "FINISHED", "COMPLETED"),
    ]
    story = explain_events(events, "run").json_report
    assert story["headline"] == "top1 (TOP) COMPLETED at 2.000 s"
    assert story["overcome"] == [{"text": "b1 (B) FAILED at 1.000 s", "because": []}]


def test_list_of_many_goals_is_truncated():
    events = [event for number in range(20) for event in (goal(0, f"a{number}", "FORMULATED"),)]
    story = explain_events(events, "run")
    assert len(story.json_report["wanted"]) == 12
    assert story.json_report["wanted"][-1]["text"] == "and 9 more"
    assert "  and 9 more" in story.lines


def test_action_is_explained():
    failed = explain_events(FAILED, "action", "talk1/10").json_report
    assert failed["headline"].endswith("ended S_FAILED: no speaker")
    assert [moment["text"] for moment in failed["actions"][0]["moments"]][-1] == "FAILED"
    waiting = explain_events(
        [*start_goal(0, "a1"), action(1, "a1", 2, "go", "PENDING")], "action", "a1/go"
    ).json_report
    assert waiting["headline"].startswith("action 2 go of a1 has been PENDING since 1.000 s")
    with pytest.raises(CxbridgeError, match="no plan-action 'a1/3'"):
        explain_events(start_goal(0, "a1"), "action", "a1/3")


def test_fact_names_rules_of_assertion_and_retraction():
    events = [
        fact(0, 4, "(note (n 1))"),
        fired(1, "count"),
        fact(1, 4, "(note (n 1))", asserted=False),
        fact(1, 5, "(note (n 2))"),
        fired(2, "forget"),
        fact(2, 5, "(note (n 2))", asserted=False),
        skill(3, "x{}", "S_RUNNING"),
    ]
    story = explain_events(events, "fact", "f-5")
    assert (
        story.json_report["headline"]
        == "f-5 was asserted at 1.000 s, instead of f-4: rule count fired just before"
    )
    assert story.lines[-1] == "it was retracted at 2.000 s: rule forget fired just before"
    assert "no rule is known" in explain_events(events, "fact", "4").lines[0]
    with pytest.raises(CxbridgeError, match="no fact f-9"):
        explain_events(events, "fact", "f-9")
    with pytest.raises(CxbridgeError) as caught:
        explain_events(start_goal(0, "a1"), "fact", "f-1")
    assert caught.value.hint == "record with --trace-level facts"
