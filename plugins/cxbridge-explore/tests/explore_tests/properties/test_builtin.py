"""Built-in properties: shipped agents have the properties, changed runs violate the properties."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import count

import pytest

from cxbridge.mainloop import Hook
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.monitor import Violation
from explore_tests.properties.runs import shipped_options, watch_run


@pytest.mark.parametrize("scenario", ["test-scenario", "test-scenario-pddl", "two-robots"])
def test_shipped_agents_have_built_in_properties(scenario: str):
    run = watch_run(shipped_options(scenario))
    assert run.violations == []
    assert run.evaluated_names >= {
        *("run-ends", "no-errors", "goals-retracted", "preconditions", "executed-once"),
        "skillers-released",
    }


# ---- violations


def watch_changed_run(
    loops: int, *changes: Callable[[ExploredRun], object], timeout: float = 30.0
) -> dict[str, Violation]:
    """Play the test scenario with a change before each loop from ``loops`` on; return the violations."""

    def before(run: ExploredRun) -> None:
        number = count(1)
        waiting = list(changes)

        def step() -> None:
            if next(number) >= loops and waiting:
                waiting.pop(0)(run)

        run.assembly.loop.add(Hook.PRE_LOOP, step)

    run = watch_run(shipped_options("test-scenario", timeout), before=before)
    return {violation.property: violation for violation in run.violations}


def assert_fact(fact: str) -> Callable[[ExploredRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.assert_string(fact)


def build_construct(construct: str) -> Callable[[ExploredRun], object]:
    return lambda run: run.assembly.agents[0].executive.env.build(construct)


STUCK = assert_fact("(goal (id STUCK) (class NOBODYS) (mode EXPANDED))")
TICKING = (
    build_construct("(defrule tick-tock (time $?) => (assert (tock)))"),
    build_construct("(defrule tock-tick ?f <- (tock) => (retract ?f))"),
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
    ("name", "loops", "changes", "message", "concerns"),
    [
        pytest.param("run-ends", 5, [STUCK], "the run is stuck", {"goal": "STUCK"}, id="stuck"),
        pytest.param("goals-retracted", 5, [STUCK], "goal STUCK is EXPANDED at the end$", {}, id="goal left"),
        pytest.param(
            "no-errors",
            5,
            [build_construct("(defrule wrong (goal) => (bind ?x (/ 1 0)))")],
            "an error in a rule: .*divide by zero.*wrong",
            {},
            id="error",
        ),
        pytest.param(
            "goals-retracted",
            5,
            [
                assert_fact("(goal (id LOST) (class NOBODYS) (mode EXPANDED))"),
                build_construct("(defrule lose ?g <- (goal (id LOST)) => (retract ?g))"),
            ],
            "goal LOST was removed in mode EXPANDED$",
            {},
            id="goal removed",
        ),
        pytest.param(
            "one-holder",
            5,
            [
                assert_fact("(goal (id ONE) (class NOBODYS) (mode DISPATCHED) (acquired-resources tap))"),
                assert_fact(
                    "(goal (id TWO) (class NOBODYS) (mode DISPATCHED) (acquired-resources sink tap))"
                ),
            ],
            "ONE and TWO both hold the resource tap$",
            {},
            id="two holders",
        ),
        pytest.param(
            "no-lost-resource",
            5,
            [
                build_construct("(deftemplate resource-request (slot goal) (slot resource))"),
                assert_fact("(resource-request (goal GONE) (resource tap))"),
            ],
            "the resource tap is held for GONE, which was removed$",
            {"goal": "GONE"},
            id="lost resource",
        ),
        pytest.param(
            "preconditions",
            20,
            [build_construct(HURRY)],
            r".*\(said nobody hello\) is false",
            {"action": "say-goodbye nobody"},
            id="false precondition",
        ),
        pytest.param(
            "executed-once",
            5,
            [build_construct(AGAIN)],
            "say-hello-again peggy of ",
            {"action": "say-hello-again peggy"},
            id="effects present",
        ),
        pytest.param(
            "executed-once",
            20,
            [build_construct(TWICE)],
            r"action \d+ of \S+ has a skill already",
            {},
            id="second skill",
        ),
        pytest.param(
            "skillers-released",
            5,
            [build_construct("(defrule keep (declare (salience 10000)) (executive-finalize) => (halt))")],
            "the control of Skiller was not released at the end$",
            {"skill": "Skiller"},
            id="not released",
        ),
    ],
)
def test_violation_has_message_and_subject(name, loops, changes, message, concerns):
    violation = watch_changed_run(loops, *changes)[name]
    assert re.match(message, violation.message), violation.message
    assert violation.as_dict().items() >= concerns.items()


def test_resting_goal_is_violation():
    violations = watch_changed_run(5, STUCK, *TICKING, timeout=90.0)
    resting, unfinished = violations["no-idle-rest"], violations["run-ends"]
    assert resting.message == "goal STUCK has been EXPANDED for 60 s and waits for nothing"
    assert 60 < resting.seconds < 62
    assert unfinished.message.startswith("the run has not ended")
