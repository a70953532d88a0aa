"""How goals came to their outcome, and why they wait: runs of a few events, and the recordings."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import PlannerCall
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history.runs import ENV, ListRun, action, fact, fired, goal, skill, skill_error, us
from tests.support import SHARED, needs_shared

MODES = ("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED")


def started(at: float, name: str, parent: str = "nil", modes=MODES):
    """A goal up to a mode."""
    return [goal(at, name, mode, parent=parent) for mode in modes]


def planned(at: float, name: str, status: str):
    return PlannerCall(us(at), ENV, "P", name, "planner", "d", "p", status, 0, 0, "")


def told(events, name: str, at: float | None = None) -> str:
    """The report about a goal, as text."""
    return "\n".join(explain(RecordedEvidence(ListRun(events), at, None), name, "goal").lines)


FAILED = [
    *started(0, "top1"),
    *started(1, "talk1", "top1"),
    action(1, "talk1", 10, "say", "FORMULATED"),
    action(2, "talk1", 10, "say", "WAITING"),
    skill(2.1, 'say{text="hi"}', "S_RUNNING"),
    action(2.2, "talk1", 10, "say", "RUNNING"),
    skill(3, 'say{text="hi"}', "S_FAILED"),
    skill_error(3, "no speaker"),
    action(3.1, "talk1", 10, "say", "EXECUTION-FAILED"),
    action(3.1, "talk1", 10, "say", "FAILED"),
    fired(3.2, "talk-fails"),
    goal(3.2, "talk1", "FINISHED", "FAILED", parent="top1"),
    fired(3.3, "run-all-fails"),
    goal(3.3, "top1", "FINISHED", "FAILED", "SUB-GOAL-FAILED talk1"),
]


def test_a_failure_is_followed_to_the_skill():
    text = told(FAILED, "top1")
    assert (
        "top1 (TOP) FAILED at 3.300 s, error: SUB-GOAL-FAILED talk1\n"
        "├─ talk1 (TALK) FAILED at 3.200 s\n"
        "│  ├─ action 10 say failed at 3.100 s\n"
        '│  │  └─ probably skill say{text="hi"} of Skiller ended S_FAILED: no speaker\n'
        "│  └─ rule talk-fails set talk1 to FAILED\n"
        "├─ rule run-all-fails set top1 to FAILED\n"
        "└─ top1 (TOP) has been FINISHED since 3.300 s, and waits for a rule that evaluates it\n"
    ) in text


def test_a_parent_without_an_error_is_followed_to_the_sub_goal_that_ended_last():
    events = [*FAILED[:-1], goal(3.3, "top1", "FINISHED", "FAILED")]
    assert "├─ talk1 (TALK) FAILED at 3.200 s" in told(events, "top1")


def test_without_firings_it_says_what_to_record():
    events = [event for event in FAILED if type(event).__name__ != "RuleFired"]
    assert "└─ the rule that decided this is unknown: firings were not recorded (level rules)" in told(
        events, "top1"
    )


RULES = {
    "agent.clp": """
(defrule any-select ?g <- (goal (mode FORMULATED) (class ?c&~MOVE)) (not (x)) => (modify ?g (mode SELECTED)))
(defrule talk-select ?g <- (goal (class MOVE|TALK) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule move-select ?g <- (goal (class MOVE) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule talk-expand ?g <- (goal (class TALK) (mode SELECTED)) => (modify ?g (mode EXPANDED)))
(defrule talk-looks (goal (class TALK) (mode FORMULATED)) => (assert (note (mode 1))))
(defrule any-mode ?g <- (goal (class TALK)) (goal (mode FORMULATED)) => (modify ?g (mode SELECTED)))
(defrule talk-prints ?g <- (goal (class TALK) (mode FORMULATED)) => (printout t ?g))
(defrule typed ?g <- (goal (sub-type RUN-ALL) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
"""
}


def test_rules_that_could_move_a_goal_on_are_named_the_most_specific_first():
    evidence = RecordedEvidence(ListRun(started(0, "talk1", modes=MODES[:1]), RULES), None, None)
    assert explain(evidence, "talk1").lines[6] == (
        "└─ rules that could do so ('cxbridge why RULE' explains each): talk-select, any-select"
    )


def test_a_goal_that_is_tried_again_has_its_last_outcome():
    first = [*started(0, "a1"), goal(1, "a1", "FINISHED", "FAILED"), goal(1, "a1", "RETRACTED", "FAILED")]
    again = [*first, *started(2, "a1")]
    assert (
        "a1 (A) has been DISPATCHED since 2.000 s; before that, it was FAILED at 1.000 s, and waits"
        in told(again, "a1")
    )
    done = [*again, goal(3, "a1", "FINISHED", "COMPLETED"), goal(3, "a1", "RETRACTED", "COMPLETED")]
    assert "a1 (A) COMPLETED at 3.000 s; before that, it was FAILED at 1.000 s\n" in told(done, "a1")


AGAIN = [
    *started(0, "a1"),
    action(0, "a1", 1, "go", "FORMULATED"),
    action(0, "a1", 2, "say", "FORMULATED"),
    action(0, "a1", 3, "wave", "FORMULATED"),
    planned(0, "a1", "none"),
    action(1, "a1", 2, "say", "FAILED"),
    goal(1, "a1", "FINISHED", "FAILED"),
    *(goal(2, "a1", mode) for mode in MODES[1:]),
]
"""A goal that a rule sets back to SELECTED after its second action has failed."""


def test_the_headline_names_the_failure_of_the_last_try():
    events = [*AGAIN, action(3, "a1", 1, "go", "FAILED"), goal(3, "a1", "FINISHED", "FAILED")]
    text = told(events, "a1")
    assert text.startswith("a1 (A) FAILED at 3.000 s: action 1 go failed at 3.000 s\n")
    assert "action 2 say failed" not in text


def test_the_plan_and_the_planner_call_of_the_first_try_are_no_causes_later():
    text = told(AGAIN, "a1")
    assert "action 3" not in text.partition("\n\n")[0]
    events = [*AGAIN, goal(3, "a1", "FINISHED", "FAILED")]
    assert told(events, "a1").startswith("a1 (A) FAILED at 3.000 s: the rule that decided this is unknown")


def test_a_sub_goal_of_the_first_try_is_no_cause_later():
    below = [*started(0, "b1", "a1"), goal(0.5, "b1", "FINISHED", "FAILED", parent="a1")]
    first = [*started(0, "a1"), *below, goal(1, "a1", "FINISHED", "FAILED")]
    events = [*first, *started(2, "a1"), goal(3, "a1", "FINISHED", "FAILED")]
    assert "b1 (B) FAILED" in told(first, "a1")
    assert "b1" not in told(events, "a1").split("\n\n")[2]


def test_a_skill_of_somebody_else_is_not_taken_for_an_action_s():
    events = [
        *started(0, "a1"),
        skill(0.5, "of-others{}", "S_RUNNING"),
        skill(0.6, "of-others{}", "S_FINAL"),
        action(1, "a1", 10, "say", "WAITING"),
        skill(1, "say{}", "S_RUNNING"),
        action(1, "a1", 10, "say", "RUNNING"),
    ]
    assert "skill say{} of Skiller has been S_RUNNING since 1.000 s" in told(events, "a1")


def test_goals_that_blame_each_other_end():
    events = [
        *started(0, "a1"),
        *started(0, "b1"),
        goal(1, "a1", "FINISHED", "FAILED", "X b1"),
        goal(1, "b1", "FINISHED", "FAILED", "X a1"),
    ]
    assert told(events, "a1").split("\n\n")[2].count("b1 (B) FAILED") == 1


def test_a_running_action():
    text = told(FAILED, "top1", at=2.5)
    assert (
        "top1 (TOP) has been DISPATCHED since 0.000 s, and waits for its actions and sub-goals\n"
        "└─ talk1 (TALK) has been DISPATCHED since 1.000 s\n"
        "   └─ action 10 say of talk1 has been RUNNING since 2.200 s\n"
        '      └─ probably skill say{text="hi"} of Skiller has been S_RUNNING since 2.100 s\n'
    ) in text


def test_an_action_whose_precondition_does_not_hold():
    events = [
        *started(0, "talk1"),
        action(1, "talk1", 10, "say", "FORMULATED"),
        action(1, "talk1", 20, "say", "FORMULATED"),
        fact(1, 5, "(plan-action (id 10) (goal-id talk1) (plan-id talk1-PLAN) (executable FALSE))"),
    ]
    text = told(events, "talk1")
    assert "└─ action 10 say of talk1 has been FORMULATED since 1.000 s, 1 more after it\n" in text
    assert "   └─ it is not executable: its precondition does not hold\n" in text


def test_resources_that_another_goal_has():
    events = [
        *started(0, "a1", modes=MODES[:4]),
        fact(1, 1, "(goal (id a1) (required-resources arm door) (acquired-resources door))"),
        fact(1, 2, "(goal (id b1) (required-resources arm) (acquired-resources arm))"),
    ]
    text = told(events, "a1")
    assert (
        "a1 (A) has been COMMITTED since 0.000 s, and waits to be dispatched, when it has its resources\n"
        in text
    )
    assert "└─ resource arm is held by goal b1\n" in text


def test_a_goal_that_was_never_selected_is_told_with_those_above():
    events = [
        *started(0, "top1", modes=MODES),
        *started(1, "a1", "top1", modes=MODES),
        *started(1, "b1", "top1", modes=MODES[:1]),
        *started(1, "c1", "b1", modes=MODES[:1]),
    ]
    assert (
        "c1 (C) has been FORMULATED since 1.000 s, and waits for a rule that selects it\n"
        "└─ b1 (B) has been FORMULATED since 1.000 s\n"
        "   ├─ top1 (TOP) has been DISPATCHED since 0.000 s\n"
        "   └─ its sibling a1 (A) has been DISPATCHED since 1.000 s\n"
    ) in told(events, "c1")


def test_parents_in_a_circle_end():
    events = [*started(0, "a1", "b1", modes=MODES[:1]), *started(0, "b1", "a1", modes=MODES[:1])]
    assert "a1 (A) has been FORMULATED" in told(events, "a1")


def test_a_class_its_numbers_and_begins_of_ids():
    events = [*started(0, "walk1"), *started(1, "walk2"), goal(2, "walk1", "FINISHED", "COMPLETED")]
    assert told(events, "WALK") == (
        "2 goals of class WALK in list.mcap at its end, 2.000 s; WALK#2: "
        "walk2 (WALK) has been DISPATCHED since 1.000 s, and waits for its actions and sub-goals\n\n"
        "WALK#1  walk1 (WALK) COMPLETED at 2.000 s\n"
        "WALK#2  walk2 (WALK) has been DISPATCHED since 1.000 s, and waits for its actions and sub-goals"
    )
    assert "\ngoal walk2 (WALK#2)" in told(events, "WALK#2")
    with pytest.raises(CxbridgeError, match="there is no goal 'WALK#3'"):
        told(events, "WALK#3")
    with pytest.raises(CxbridgeError, match="several goals begin with 'wal'"):
        told(events, "wal")
    with pytest.raises(CxbridgeError, match="there is no goal 'run'"):
        told(events, "run")


LOG = SHARED / "traces" / "test-scenario" / "skiller-1" / "fawkes.log"
FAILING = "PARALLEL-AUTOMATIC-SUBGOAL-gen22"


WAITING_TALK = "gen9 (TALK) has been DISPATCHED since 1.893 s, and waits for its actions and sub-goals"
RUNNING_SKILL = 'skill say{text="Hello again peggy", wait=true} of Skiller has been S_RUNNING since 4.238 s'


@needs_shared
@pytest.mark.parametrize(
    ("name", "at", "first", "expected"),
    [
        (
            "gen8",
            None,
            2,
            ("goal gen8 (ALWAYS-REJECT#1), sub-goal of RUN-ONE-TESTGOAL-PARENT-gen27 (TESTGOAL-PARENT)",),
        ),
        (
            "gen8",
            None,
            5,
            (
                "gen8 (ALWAYS-REJECT) REJECTED at 1.883 s",
                "└─ rule always-reject-goal-reject set gen8 to REJECTED",
            ),
        ),
        (
            "gen10",
            None,
            5,
            ("gen10 (SUCCEED-SECOND-TRY) COMPLETED at 1.890 s; before that, it was FAILED at 1.887 s",),
        ),
        (
            FAILING,
            None,
            5,
            (
                f"{FAILING} (AUTOMATIC-SUBGOAL) FAILED at 12.022 s, error: SUB-GOAL-FAILED gen20",
                "├─ gen20 (ALWAYS-FAIL) FAILED at 12.020 s",
                "│  └─ rule always-fail-goal-fail set gen20 to FAILED",
                f"└─ rule run-parallel-goal-finish-all-subgoals-retracted set {FAILING} to FAILED",
            ),
        ),
        (
            "TALK",
            5,
            5,
            (
                WAITING_TALK,
                "└─ action 40 say-hello-again(peggy) of gen9 has been RUNNING since 4.239 s, 1 more after it",
                f"   └─ {RUNNING_SKILL}",
            ),
        ),
    ],
)
def test_a_goal_of_a_real_fawkes(name, at, first, expected):
    lines = explain(RecordedEvidence(open_run(LOG), at, None), name).lines
    assert lines[first : first + len(expected)] == expected
