"""Explanations of the outcomes of goals and of waiting goals, for runs of a few events and for recordings."""

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


def start_goal(at: float, name: str, parent: str = "nil", modes=MODES):
    """Return the transitions of a goal up to a mode."""
    return [goal(at, name, mode, parent=parent) for mode in modes]


def call_planner(at: float, name: str, status: str):
    return PlannerCall(us(at), ENV, "P", name, "planner", "d", "p", status, 0, 0, "")


def explain_goal(events, name: str, at: float | None = None) -> str:
    """Return the report about a goal as text."""
    return "\n".join(explain(RecordedEvidence(ListRun(events), at, None), name, "goal").lines)


FAILED = [
    *start_goal(0, "top1"),
    *start_goal(1, "talk1", "top1"),
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


def test_failure_is_followed_to_skill():
    assert (
        "top1 (TOP) FAILED at 3.300 s, error: SUB-GOAL-FAILED talk1\n"
        "├─ talk1 (TALK) FAILED at 3.200 s\n"
        "│  ├─ action 10 say failed at 3.100 s\n"
        '│  │  └─ probably skill say{text="hi"} of Skiller ended S_FAILED: no speaker\n'
        "│  └─ rule talk-fails set talk1 to FAILED\n"
        "├─ rule run-all-fails set top1 to FAILED\n"
        "└─ top1 (TOP) has been FINISHED since 3.300 s, and waits for a rule that evaluates it\n"
    ) in explain_goal(FAILED, "top1")


def test_parent_without_error_names_last_ended_sub_goal():
    events = [*FAILED[:-1], goal(3.3, "top1", "FINISHED", "FAILED")]
    assert "├─ talk1 (TALK) FAILED at 3.200 s" in explain_goal(events, "top1")


def test_story_without_firings_names_level_to_record():
    events = [event for event in FAILED if type(event).__name__ != "RuleFired"]
    assert (
        "└─ the rule that decided this is unknown: firings were not recorded (level rules)"
        in explain_goal(events, "top1")
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


def test_rules_for_next_mode_are_named_most_specific_first():
    evidence = RecordedEvidence(ListRun(start_goal(0, "talk1", modes=MODES[:1]), RULES), None, None)
    assert explain(evidence, "talk1").lines[6] == (
        "└─ rules that could do so ('cxbridge why RULE' explains each): talk-select, any-select"
    )


def test_retried_goal_has_last_outcome():
    first_try = [
        *start_goal(0, "a1"),
        goal(1, "a1", "FINISHED", "FAILED"),
        goal(1, "a1", "RETRACTED", "FAILED"),
    ]
    second_try = [*first_try, *start_goal(2, "a1")]
    assert (
        "a1 (A) has been DISPATCHED since 2.000 s; before that, it was FAILED at 1.000 s, and waits"
        in explain_goal(second_try, "a1")
    )
    done = [*second_try, goal(3, "a1", "FINISHED", "COMPLETED"), goal(3, "a1", "RETRACTED", "COMPLETED")]
    assert "a1 (A) COMPLETED at 3.000 s; before that, it was FAILED at 1.000 s\n" in explain_goal(done, "a1")


RETRIED = [
    *start_goal(0, "a1"),
    action(0, "a1", 1, "go", "FORMULATED"),
    action(0, "a1", 2, "say", "FORMULATED"),
    action(0, "a1", 3, "wave", "FORMULATED"),
    call_planner(0, "a1", "none"),
    action(1, "a1", 2, "say", "FAILED"),
    goal(1, "a1", "FINISHED", "FAILED"),
    *(goal(2, "a1", mode) for mode in MODES[1:]),
]
"""A goal that a rule sets back to SELECTED after its second action has failed."""


def test_headline_names_failure_of_last_try():
    events = [*RETRIED, action(3, "a1", 1, "go", "FAILED"), goal(3, "a1", "FINISHED", "FAILED")]
    text = explain_goal(events, "a1")
    assert text.startswith("a1 (A) FAILED at 3.000 s: action 1 go failed at 3.000 s\n")
    assert "action 2 say failed" not in text


def test_plan_and_planner_call_of_first_try_are_no_causes():
    text = explain_goal(RETRIED, "a1")
    assert "action 3" not in text.partition("\n\n")[0]
    events = [*RETRIED, goal(3, "a1", "FINISHED", "FAILED")]
    assert explain_goal(events, "a1").startswith(
        "a1 (A) FAILED at 3.000 s: the rule that decided this is unknown"
    )


def test_sub_goal_of_first_try_is_no_cause():
    sub_goal = [*start_goal(0, "b1", "a1"), goal(0.5, "b1", "FINISHED", "FAILED", parent="a1")]
    first_try = [*start_goal(0, "a1"), *sub_goal, goal(1, "a1", "FINISHED", "FAILED")]
    events = [*first_try, *start_goal(2, "a1"), goal(3, "a1", "FINISHED", "FAILED")]
    assert "b1 (B) FAILED" in explain_goal(first_try, "a1")
    assert "b1" not in explain_goal(events, "a1").split("\n\n")[2]


def test_skill_without_action_is_not_attributed_to_action():
    events = [
        *start_goal(0, "a1"),
        skill(0.5, "unrelated{}", "S_RUNNING"),
        skill(0.6, "unrelated{}", "S_FINAL"),
        action(1, "a1", 10, "say", "WAITING"),
        skill(1, "say{}", "S_RUNNING"),
        action(1, "a1", 10, "say", "RUNNING"),
    ]
    assert "skill say{} of Skiller has been S_RUNNING since 1.000 s" in explain_goal(events, "a1")


def test_story_of_goals_with_mutual_errors_ends():
    events = [
        *start_goal(0, "a1"),
        *start_goal(0, "b1"),
        goal(1, "a1", "FINISHED", "FAILED", "X b1"),
        goal(1, "b1", "FINISHED", "FAILED", "X a1"),
    ]
    assert explain_goal(events, "a1").split("\n\n")[2].count("b1 (B) FAILED") == 1


def test_story_of_running_action_names_skill():
    assert (
        "top1 (TOP) has been DISPATCHED since 0.000 s, and waits for its actions and sub-goals\n"
        "└─ talk1 (TALK) has been DISPATCHED since 1.000 s\n"
        "   └─ action 10 say of talk1 has been RUNNING since 2.200 s\n"
        '      └─ probably skill say{text="hi"} of Skiller has been S_RUNNING since 2.100 s\n'
    ) in explain_goal(FAILED, "top1", at=2.5)


def test_story_names_false_precondition_of_action():
    events = [
        *start_goal(0, "talk1"),
        action(1, "talk1", 10, "say", "FORMULATED"),
        action(1, "talk1", 20, "say", "FORMULATED"),
        fact(1, 5, "(plan-action (id 10) (goal-id talk1) (plan-id talk1-PLAN) (executable FALSE))"),
    ]
    assert (
        "└─ action 10 say of talk1 has been FORMULATED since 1.000 s, 1 more after it\n"
        "   └─ it is not executable: its precondition does not hold\n"
    ) in explain_goal(events, "talk1")


def test_story_names_rule_that_fails_action_after_its_skill():
    events = [
        *start_goal(0, "a1"),
        action(0, "a1", 1, "look", "WAITING"),
        skill(0, "look{}", "S_RUNNING"),
        action(1, "a1", 1, "look", "RUNNING"),
        skill(2, "look{}", "S_FINAL"),
        action(2, "a1", 1, "look", "EXECUTION-SUCCEEDED"),
        action(4, "a1", 1, "look", "FAILED"),
        goal(4, "a1", "FINISHED", "FAILED"),
    ]
    assert explain_goal(events, "a1").startswith(
        "a1 (A) FAILED at 4.000 s: action 1 look failed at 4.000 s: probably skill look{} of Skiller "
        "ended S_FINAL, then a rule set the action to FAILED\n"
    )
    slots = '(id 1) (goal-id a1) (plan-id a1-PLAN) (state FAILED) (error-msg "no result")'
    events.insert(-2, fact(4, 1, f"(plan-action {slots})"))
    assert "action 1 look failed at 4.000 s: no result\n" in explain_goal(events, "a1")


def test_story_names_goal_that_holds_resource():
    events = [
        *start_goal(0, "a1", modes=MODES[:4]),
        fact(1, 1, "(goal (id a1) (required-resources arm door) (acquired-resources door))"),
        fact(1, 2, "(goal (id b1) (required-resources arm) (acquired-resources arm))"),
    ]
    assert (
        "a1 (A) has been COMMITTED since 0.000 s, and waits to be dispatched, when it has its resources\n"
        "└─ resource arm is held by goal b1\n"
    ) in explain_goal(events, "a1")


def test_story_of_unselected_goal_has_parents_and_siblings():
    events = [
        *start_goal(0, "top1", modes=MODES),
        *start_goal(1, "a1", "top1", modes=MODES),
        *start_goal(1, "b1", "top1", modes=MODES[:1]),
        *start_goal(1, "c1", "b1", modes=MODES[:1]),
    ]
    assert (
        "c1 (C) has been FORMULATED since 1.000 s, and waits for a rule that selects it\n"
        "└─ b1 (B) has been FORMULATED since 1.000 s\n"
        "   ├─ top1 (TOP) has been DISPATCHED since 0.000 s\n"
        "   └─ its sibling a1 (A) has been DISPATCHED since 1.000 s\n"
    ) in explain_goal(events, "c1")


def test_story_of_circular_parents_ends():
    events = [*start_goal(0, "a1", "b1", modes=MODES[:1]), *start_goal(0, "b1", "a1", modes=MODES[:1])]
    assert "a1 (A) has been FORMULATED" in explain_goal(events, "a1")


def test_goals_are_found_by_class_number_and_prefix():
    events = [*start_goal(0, "walk1"), *start_goal(1, "walk2"), goal(2, "walk1", "FINISHED", "COMPLETED")]
    assert explain_goal(events, "WALK") == (
        "2 goals of class WALK in list.mcap at its end, 2.000 s; WALK#2: "
        "walk2 (WALK) has been DISPATCHED since 1.000 s, and waits for its actions and sub-goals\n\n"
        "WALK#1  walk1 (WALK) COMPLETED at 2.000 s\n"
        "WALK#2  walk2 (WALK) has been DISPATCHED since 1.000 s, and waits for its actions and sub-goals"
    )
    assert "\ngoal walk2 (WALK#2)" in explain_goal(events, "WALK#2")
    with pytest.raises(CxbridgeError, match="there is no goal 'WALK#3'"):
        explain_goal(events, "WALK#3")
    with pytest.raises(CxbridgeError, match="several goals begin with 'wal'"):
        explain_goal(events, "wal")
    with pytest.raises(CxbridgeError, match="there is no goal 'run'"):
        explain_goal(events, "run")


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
def test_story_of_goal_in_fawkes_log(name, at, first, expected):
    lines = explain(RecordedEvidence(open_run(LOG), at, None), name).lines
    assert lines[first : first + len(expected)] == expected
