"""The built-in properties: the shipped agents have them, and each is violated by a run that lacks it."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import count

import pytest

from cxbridge.mainloop import Hook
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.monitor import Violation
from explore_tests.properties.runs import shipped, watched


@pytest.mark.parametrize("scenario", ["test-scenario", "test-scenario-pddl", "two-robots"])
def test_the_shipped_agents_have_all_of_them(scenario: str):
    run = watched(shipped(scenario))
    assert run.violations == []
    assert run.evaluated_names >= {
        *("run-ends", "no-errors", "goals-retracted", "preconditions", "executed-once"),
        "skillers-released",
    }


# ---- violated


def disturbed(
    loops: int, *changes: Callable[[ExploredRun], object], timeout: float = 30.0
) -> dict[str, Violation]:
    """Play the test scenario, and change something in it before the agent thinks in some loops."""

    def before(run: ExploredRun) -> None:
        number = count(1)
        waiting = list(changes)

        def step() -> None:
            if next(number) >= loops and waiting:
                waiting.pop(0)(run)

        run.assembly.loop.add(Hook.PRE_LOOP, step)

    run = watched(shipped("test-scenario", timeout), before=before)
    return {violation.property: violation for violation in run.violations}


def asserting(fact: str) -> Callable[[ExploredRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.assert_string(fact)


def building(construct: str) -> Callable[[ExploredRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.build(construct)


STUCK = asserting("(goal (id STUCK) (class NOBODYS) (mode EXPANDED))")
TICKING = (
    building("(defrule tick-tock (time $?) => (assert (tock)))"),
    building("(defrule tock-tick ?f <- (tock) => (retract ?f))"),
)
HURRY = (
    "(defrule hurry (declare (salience 5000)) (not (hurried))"
    " ?a <- (plan-action (action-name say-goodbye) (state FORMULATED)) =>"
    " (assert (hurried)) (modify ?a (state RUNNING) (param-values nobody)))"
)
AGAIN = (
    "(defrule again (declare (salience -5000)) (not (done-again))"
    " ?a <- (plan-action (action-name say-hello-again) (state FINAL)) =>"
    " (assert (done-again)) (modify ?a (state FORMULATED)))"
)
TWICE = (
    "(defrule twice (not (called-twice)) (skill-action-execinfo (goal-id ?g) (plan-id ?p)"
    " (action-id ?a) (skill-name ?n)) => (assert (called-twice) (skill-action-execinfo (goal-id ?g)"
    ' (plan-id ?p) (action-id ?a) (skill-name ?n) (skill-id another) (skiller "Other"))))'
)


@pytest.mark.parametrize(
    ("name", "loops", "changes", "message", "concerned"),
    [
        pytest.param("run-ends", 5, [STUCK], "the run is stuck", {"goal": "STUCK"}, id="stuck"),
        pytest.param("goals-retracted", 5, [STUCK], "goal STUCK is EXPANDED at the end$", {}, id="left"),
        pytest.param(
            "no-errors",
            5,
            [building("(defrule wrong (goal) => (bind ?x (/ 1 0)))")],
            "an error in a rule: .*divide by zero.*wrong",
            {},
            id="error",
        ),
        pytest.param(
            "goals-retracted",
            5,
            [
                asserting("(goal (id LOST) (class NOBODYS) (mode EXPANDED))"),
                building("(defrule lose ?g <- (goal (id LOST)) => (retract ?g))"),
            ],
            "goal LOST was removed in mode EXPANDED$",
            {},
            id="gone",
        ),
        pytest.param(
            "one-holder",
            5,
            [
                asserting("(goal (id ONE) (class NOBODYS) (mode DISPATCHED) (acquired-resources tap))"),
                asserting("(goal (id TWO) (class NOBODYS) (mode DISPATCHED) (acquired-resources sink tap))"),
            ],
            "ONE and TWO both hold the resource tap$",
            {},
            id="two holders",
        ),
        pytest.param(
            "no-lost-resource",
            5,
            [
                building("(deftemplate resource-request (slot goal) (slot resource))"),
                asserting("(resource-request (goal GONE) (resource tap))"),
            ],
            "the resource tap is held for GONE, which was removed$",
            {"goal": "GONE"},
            id="lost resource",
        ),
        pytest.param(
            "preconditions",
            20,
            [building(HURRY)],
            r".*\(said nobody hello\) is false",
            {"action": "say-goodbye nobody"},
            id="false precondition",
        ),
        pytest.param(
            "executed-once",
            5,
            [building(AGAIN)],
            "say-hello-again peggy of ",
            {"action": "say-hello-again peggy"},
            id="effects there",
        ),
        pytest.param(
            "executed-once",
            20,
            [building(TWICE)],
            r"action \d+ of \S+ has a skill already",
            {},
            id="second skill",
        ),
        pytest.param(
            "skillers-released",
            5,
            [building("(defrule keep (declare (salience 10000)) (executive-finalize) => (halt))")],
            "the control of Skiller was not released at the end$",
            {"skill": "Skiller"},
            id="not released",
        ),
    ],
)
def test_a_violation_and_whom_it_concerns(name, loops, changes, message, concerned):
    violation = disturbed(loops, *changes)[name]
    assert re.match(message, violation.message), violation.message
    assert violation.as_dict().items() >= concerned.items()


def test_a_goal_that_rests():
    violations = disturbed(5, STUCK, *TICKING, timeout=90.0)
    rest, ends = violations["no-idle-rest"], violations["run-ends"]
    assert rest.message == "goal STUCK has been EXPANDED for 60 s and waits for nothing"
    assert 60 < rest.seconds < 62
    assert ends.message.startswith("the run has not ended")
