"""The built-in properties: the shipped agents have them, and each is violated by a run that lacks it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import pytest

from cxbridge.mainloop import Hook
from cxbridge_explore.worlds.points import Step
from cxbridge_explore.worlds.run import WorldRun
from explore_tests.properties.runs import BUILTIN, Watched, shipped, watched

HELLO = "Skiller: say{text='Hello peggy', wait=True}"


@pytest.mark.parametrize("scenario", ["test-scenario", "test-scenario-pddl", "two-robots"])
def test_the_shipped_agents_have_all_of_them(scenario: str):
    run = watched(shipped(scenario))
    assert run.violations == []
    assert run.evaluated >= {
        *("run-ends", "no-errors", "goals-retracted", "preconditions", "executed-once"),
        "skillers-released",
    }


def test_a_failed_skill_violates_none():
    assert watched(shipped("test-scenario"), path={0: Step(HELLO, "fails")}).violations == []


def test_what_was_not_evaluated_is_known():
    assert "one-holder" not in watched(shipped("test-scenario")).evaluated


def test_each_state_can_be_compared():
    run = watched(shipped("test-scenario"))
    assert None not in run.states
    assert len({hash(state) for state in run.states}) > 1


def test_each_has_a_name_of_its_own():
    assert len({each.name for each in BUILTIN}) == len(BUILTIN)


# ---- violated


def disturbed(loops: int, *changes: Callable[[WorldRun], object], timeout: float = 30.0) -> Watched:
    """Play the test scenario, and change something in it before the agent thinks in some loops."""

    def before(run: WorldRun) -> None:
        number = count(1)
        waiting = list(changes)

        def step() -> None:
            if next(number) >= loops and waiting:
                waiting.pop(0)(run)

        run.assembly.loop.add(Hook.PRE_LOOP, step)

    return watched(shipped("test-scenario", timeout), before=before)


def asserting(fact: str) -> Callable[[WorldRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.assert_string(fact)


def building(construct: str) -> Callable[[WorldRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.build(construct)


def test_a_run_that_is_stuck_and_its_goal():
    run = disturbed(5, asserting("(goal (id STUCK) (class NOBODYS) (mode EXPANDED))"))
    ends = run.of("run-ends")
    assert ends is not None
    assert ends.message.startswith("the run is stuck")
    assert ends.goal == "STUCK"
    retracted = run.of("goals-retracted")
    assert retracted is not None
    assert retracted.message == "goal STUCK is EXPANDED at the end"


def test_a_goal_that_rests():
    run = disturbed(
        5,
        asserting("(goal (id STUCK) (class NOBODYS) (mode EXPANDED))"),
        building("(defrule tick-tock (time $?) => (assert (tock)))"),
        building("(defrule tock-tick ?f <- (tock) => (retract ?f))"),
        timeout=90.0,
    )
    rest = run.of("no-idle-rest")
    assert rest is not None
    assert rest.message == "goal STUCK has been EXPANDED for 60 s and waits for nothing"
    assert 60 < rest.seconds < 62
    ends = run.of("run-ends")
    assert ends is not None
    assert ends.message.startswith("the run has not come to its end")


def test_an_error_in_a_rule():
    run = disturbed(5, building("(defrule wrong (goal) => (bind ?x (/ 1 0)))"))
    error = run.of("no-errors")
    assert error is not None
    assert "divide by zero" in error.message
    assert "wrong" in error.message


def test_a_goal_that_is_gone_too_early():
    run = disturbed(
        5,
        asserting("(goal (id LOST) (class NOBODYS) (mode EXPANDED))"),
        building("(defrule lose ?g <- (goal (id LOST)) => (retract ?g))"),
    )
    gone = run.of("goals-retracted")
    assert gone is not None
    assert gone.message == "goal LOST is gone, it was EXPANDED"


def test_two_holders_of_a_resource():
    run = disturbed(
        5,
        asserting("(goal (id ONE) (class NOBODYS) (mode DISPATCHED) (acquired-resources tap))"),
        asserting("(goal (id TWO) (class NOBODYS) (mode DISPATCHED) (acquired-resources sink tap))"),
    )
    holders = run.of("one-holder")
    assert holders is not None
    assert holders.message == "ONE and TWO have both got the resource tap"


def test_a_resource_of_a_goal_that_is_gone():
    run = disturbed(
        5,
        building("(deftemplate resource-request (slot goal) (slot resource))"),
        asserting("(resource-request (goal GONE) (resource tap))"),
    )
    lost = run.of("no-lost-resource")
    assert lost is not None
    assert lost.message == "the resource tap is held for GONE, which is gone"
    assert lost.goal == "GONE"


def test_an_action_that_starts_with_a_false_precondition():
    run = disturbed(
        20,
        building(
            "(defrule hurry (declare (salience 5000)) (not (hurried))"
            " ?a <- (plan-action (action-name say-goodbye) (state FORMULATED)) =>"
            " (assert (hurried)) (modify ?a (state RUNNING) (param-values nobody)))"
        ),
    )
    false = run.of("preconditions")
    assert false is not None
    assert "(said nobody hello) is false" in false.message
    assert false.action == "say-goodbye nobody"


AGAIN = (
    "(defrule again (declare (salience -5000)) (not (done-again))"
    " ?a <- (plan-action (action-name say-hello-again) (state FINAL)) =>"
    " (assert (done-again)) (modify ?a (state FORMULATED)))"
)


def test_an_action_whose_effects_are_there():
    twice = disturbed(5, building(AGAIN)).of("executed-once")
    assert twice is not None
    assert twice.message.startswith("say-hello-again peggy of ")
    assert twice.action == "say-hello-again peggy"


def test_a_second_skill_for_an_action():
    run = disturbed(
        20,
        building(
            "(defrule twice (not (called-twice)) (skill-action-execinfo (goal-id ?g) (plan-id ?p)"
            " (action-id ?a) (skill-name ?n)) => (assert (called-twice) (skill-action-execinfo (goal-id ?g)"
            ' (plan-id ?p) (action-id ?a) (skill-name ?n) (skill-id another) (skiller "Other"))))'
        ),
    )
    twice = run.of("executed-once")
    assert twice is not None
    assert twice.message.startswith("a second skill was called for action")


def test_a_skiller_that_is_not_released():
    run = disturbed(5, building("(defrule keep (declare (salience 10000)) (executive-finalize) => (halt))"))
    kept = run.of("skillers-released")
    assert kept is not None
    assert kept.message == "the control of Skiller was not released at the end"
