"""Runs, tests, explorations and sweeps have an equal verdict on MAINTAIN goals."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.run.result import COMPLETED, TIMED_OUT, UNSUCCESSFUL
from cxbridge.run.run import run_scenario
from cxbridge.testing.agent_run import AgentRun
from cxbridge.trace.formats.registry import open_run
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.reading import find_property
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import SweepJob
from cxbridge_explore.worlds.points import PathChooser
from tests.run.mini import write_scenario

TIMEOUT_S = 5.0
KEEP = "(goal (id KEEP-CHARGED) (class KEEP) (type MAINTAIN) (mode {}))"
TOUR = "(goal (id TOUR) (class TOUR) (mode RETRACTED) (outcome {}))"
GOAL = "(goal (id {}) (class SOME) (parent {}) (mode {}) {})"
ACTION = """(plan (id P) (goal-id KEEP-CHARGED))
 (plan-action (id 1) (plan-id P) (goal-id KEEP-CHARGED) (action-name charge) (state {}))"""

KEEPING = KEEP.format("DISPATCHED")
DONE = TOUR.format("COMPLETED")
MAINTAINED = COMPLETED, "maintaining KEEP-CHARGED"

CASES = {
    **{f"{mode} and maintains": (KEEP.format(mode) + DONE, MAINTAINED) for mode in ("SELECTED", "EXPANDED")},
    **{
        f"{mode} and maintains": (KEEP.format(mode) + DONE, MAINTAINED)
        for mode in ("COMMITTED", "DISPATCHED")
    },
    "not selected": (KEEP.format("FORMULATED") + DONE, (TIMED_OUT, "KEEP-CHARGED is FORMULATED")),
    "finished": (KEEP.format("FINISHED") + DONE, (TIMED_OUT, "KEEP-CHARGED is FINISHED")),
    "evaluated": (KEEP.format("EVALUATED") + DONE, (TIMED_OUT, "KEEP-CHARGED is EVALUATED")),
    "abandoned": (
        GOAL.format("KEEP-CHARGED", "nil", "RETRACTED", "(type MAINTAIN) (outcome FAILED)") + DONE,
        (UNSUCCESSFUL, "KEEP-CHARGED ended FAILED"),
    ),
    "second goal failed": (KEEPING + TOUR.format("FAILED"), (UNSUCCESSFUL, "TOUR ended FAILED")),
    "second goal open": (
        KEEPING + GOAL.format("A", "nil", "DISPATCHED", ""),
        (TIMED_OUT, "A is DISPATCHED"),
    ),
    "sub-goal pursued": (
        KEEPING + DONE + GOAL.format("CHARGE", "KEEP-CHARGED", "DISPATCHED", ""),
        (TIMED_OUT, "KEEP-CHARGED is DISPATCHED"),
    ),
    "sub-goal over with sub-goals": (
        KEEPING
        + DONE
        + GOAL.format("CHARGE", "KEEP-CHARGED", "RETRACTED", "(acquired-resources dock)")
        + GOAL.format("DOCK", "CHARGE", "FORMULATED", "")
        + GOAL.format("TURN", "DOCK", "FORMULATED", ""),
        MAINTAINED,
    ),
    "sub-goal maintains": (
        KEEPING + DONE + GOAL.format("WARM", "KEEP-CHARGED", "SELECTED", "(type MAINTAIN)"),
        MAINTAINED,
    ),
    "sub-goal of maintaining sub-goal pursued": (
        KEEPING
        + DONE
        + GOAL.format("WARM", "KEEP-CHARGED", "SELECTED", "(type MAINTAIN)")
        + GOAL.format("HEAT", "WARM", "DISPATCHED", ""),
        (TIMED_OUT, "KEEP-CHARGED is DISPATCHED"),
    ),
    "action left": (KEEPING + DONE + ACTION.format("PENDING"), (TIMED_OUT, "action charge is PENDING")),
    "actions over": (KEEPING + DONE + ACTION.format("FINAL"), MAINTAINED),
    "two MAINTAIN goals": (
        KEEPING + GOAL.format("WARM", "nil", "SELECTED", "(type MAINTAIN)") + DONE,
        (COMPLETED, "maintaining KEEP-CHARGED, WARM"),
    ),
    "MAINTAIN goal only": (KEEPING, MAINTAINED),
}


def make_options(tmp_path: Path, facts: str, **more: object) -> RunOptions:
    """Return the options of an agent that asserts ``facts`` in its first loop."""
    agent = f"(defrule begin (executive-initialized) => (assert {facts}))"
    scenario = write_scenario(tmp_path / "mini", agent=agent)
    return RunOptions(scenario=scenario, timeout=TIMEOUT_S, skiller="none", **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(("facts", "expected"), CASES.values(), ids=CASES)
def test_run_test_exploration_and_sweep_have_equal_verdict(
    tmp_path: Path, facts: str, expected: tuple[int, str]
) -> None:
    status, reason = expected
    is_over = status != TIMED_OUT
    options = make_options(tmp_path, facts, trace=tmp_path / "run.mcap")

    result = run_scenario(options)
    assert (result.status, result.to_json()["status"]) == (status, status)
    assert reason in result.reason
    metadata = open_run(tmp_path / "run.mcap").metadata()
    assert (metadata["status"], metadata["reason"]) == (str(status), result.reason)

    options = make_options(tmp_path, facts)
    with AgentRun(options, scripted=True) as run:
        if is_over:
            run.to_end(TIMEOUT_S)
        else:
            with pytest.raises(AssertionError, match="was not over within"):
                run.to_end(TIMEOUT_S)
    with AgentRun(options, scripted=True) as run:
        if is_over:
            run.assert_properties("run-ends", timeout=TIMEOUT_S)
        else:
            with pytest.raises(AssertionError, match="run-ends is violated"):
                run.assert_properties("run-ends", timeout=TIMEOUT_S)

    with ExploredRun(options, [find_property("run-ends")], PathChooser({})) as explored:
        leaf = explored.play_to_leaf()
    assert (leaf.outcome, not leaf.violations) == (result.word, is_over)
    row = play_seed(SweepJob(options), 1, PathChooser({}))
    assert (row.outcome, reason in row.reason) == (result.word, True)


CHARGES = """
(defrule begin (executive-initialized) => (assert (battery 3) (now 0) {keep} {tour}))
(defrule tick (time ? ?usec) ?now <- (now ?before&~?usec) => (retract ?now) (assert (now ?usec) (tick)))
(defrule drain ?t <- (tick) ?b <- (battery ?left&:(> ?left 0)) =>
  (retract ?t ?b) (assert (battery (- ?left 1))))
(defrule low (battery 0) (not (goal (class CHARGE) (mode DISPATCHED))) =>
  (assert (goal (id (gensym*)) (class CHARGE) (parent KEEP-CHARGED) (mode DISPATCHED)) (charging 0)))
(defrule charge ?t <- (tick) ?c <- (charging ?n&:(< ?n 2)) => (retract ?t ?c) (assert (charging (+ ?n 1))))
(defrule full ?b <- (battery 0) ?c <- (charging 2) ?g <- (goal (class CHARGE) (mode DISPATCHED)) =>
  (retract ?b ?c) (assert (battery 3)) (modify ?g (mode RETRACTED) (outcome COMPLETED)))
(defrule end ?g <- (goal (class TOUR) (mode DISPATCHED)) (charging 1) =>
  (modify ?g (mode RETRACTED) (outcome COMPLETED)))
"""


def test_run_continues_during_charging_and_ends_afterwards(tmp_path: Path) -> None:
    tour = GOAL.format("TOUR", "nil", "DISPATCHED", "").replace("SOME", "TOUR")
    scenario = write_scenario(tmp_path / "mini", agent=CHARGES.format(keep=KEEPING, tour=tour))
    result = run_scenario(RunOptions(scenario=scenario, timeout=TIMEOUT_S, skiller="none"))
    assert (result.status, result.reason) == MAINTAINED
    outcomes = {goal.goal_class: goal.outcome for goal in result.goals}
    assert outcomes == {"KEEP": "UNKNOWN", "TOUR": "COMPLETED", "CHARGE": "COMPLETED"}
