"""Retrying a goal and giving it a time limit, in the built-in core."""

from __future__ import annotations

import pytest

from tests.executive.core.core_bench import Bench
from tests.executive.core.goal_bench import PREFIXES, error, grow, lone, selected

# --- retry -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("outcome", ["FAILED", "REJECTED"])
def test_retry_gives_up_after_last_try(bench: Bench, outcome: str) -> None:
    parent = grow(bench, "retry", outcome, option="3")
    bench.tick()
    assert selected(bench) == ["C1"] * 3
    assert bench.state(parent) == ("FINISHED", outcome)
    message = f"RETRY goal '{parent}' sub-goal 'C1' {outcome} in try 3/3"
    assert error(bench, parent) == (f"SUB-GOAL-{outcome}", message)
    assert bench.texts("W") == [
        f"Committing to RETRY {parent} -> C1 (try 2/3)",
        f"Committing to RETRY {parent} -> C1 (try 3/3)",
    ]


TREES = {
    "run-all": "(goal-tree-assert-run-all AUTOMATIC-SUBGOAL {done} {bad})",
    "run-one": "(goal-tree-assert-run-one AUTOMATIC-SUBGOAL {rejected} {bad})",
    "try-all": "(goal-tree-assert-try-all AUTOMATIC-SUBGOAL {rejected} {bad})",
    "parallel": "(goal-tree-assert-run-parallel AUTOMATIC-SUBGOAL NONE {done} {bad})",
    "timeout": "(goal-tree-assert-timeout AUTOMATIC-SUBGOAL 1000 {bad})",
    "deep": "(goal-tree-assert-run-all AUTOMATIC-SUBGOAL {done}"
    " (goal-tree-assert-try-all AUTOMATIC-SUBGOAL {rejected} {bad}))",
}


def tree(kind: str, bad: str) -> str:
    """A tree whose leaf BAD has that class."""
    leaves = {"done": "WILL-COMPLETED", "rejected": "WILL-REJECTED", "bad": bad}
    made = {name: f"(assert (goal (id {name.upper()}) (class {kind})))" for name, kind in leaves.items()}
    return TREES[kind].format(**made)


@pytest.mark.parametrize("kind", TREES)
def test_retry_repeats_whole_tree(bench: Bench, kind: str) -> None:
    """Fawkes keeps the goals below as they are: the tree waits for ever, or fails without another try."""
    bench.env.eval(f"(goal-tree-assert-retry ROOT 3 {tree(kind, 'SECOND-TRY')})")
    bench.tick()
    parent = bench.one("goal", sub_type="RETRY-SUBGOAL")
    assert (parent["mode"], parent["outcome"]) == ("FINISHED", "COMPLETED")
    assert parent["meta"] == ("num-tries", 2)
    assert selected(bench).count("BAD") == 2
    assert not bench.all("goal-tried-again") + bench.all("goals-below-again")


@pytest.mark.parametrize("leaf", ["WILL-FAILED", "WILL-REJECTED"])
@pytest.mark.parametrize("kind", ["RUN-ALL", "RUN-ONE", "TRY-ALL"])
def test_retry_removes_old_sub_goals_of_expander(bench: Bench, kind: str, leaf: str) -> None:
    """A sub-goal that ends in its own selection leaves no step for removing the old sub-goals."""
    bench.env.build(
        "(defrule expand-it ?g <- (goal (id ?id) (class EXPANDS) (mode SELECTED)) =>"
        f" (loop-for-count 2 (assert (goal (id (gensym*)) (class {leaf}) (parent ?id))))"
        " (modify ?g (mode EXPANDED)))"
    )
    made = f"(assert (goal (id E) (class EXPANDS) (sub-type {kind}-OF-SUBGOALS)))"
    bench.env.eval(f"(goal-tree-assert-retry ROOT 3 {made})")
    bench.tick()
    assert bench.one("goal", **{"class": "ROOT"})["mode"] == "FINISHED"
    assert selected(bench).count("E") == 3
    leaves = [text for text in selected(bench) if text != "E"]
    assert len(set(leaves)) == len(leaves)


def test_exact_retry_waits_for_ever_as_in_fawkes(bench: Bench) -> None:
    bench.env.eval('(assert (confval (path "/clips-executive/exact-retry") (type BOOL) (value TRUE)))')
    bench.env.eval(f"(goal-tree-assert-retry ROOT 3 {tree('run-all', 'SECOND-TRY')})")
    bench.tick()
    assert bench.one("goal", **{"class": "ROOT"})["mode"] == "DISPATCHED"
    assert bench.one("goal", sub_type="RUN-ALL-OF-SUBGOALS")["mode"] == "EXPANDED"


def test_retry_removes_old_plan(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.build(
        "(defrule plan-it (goal (id ?id) (class PLANNED) (mode SELECTED)) =>"
        " (bind ?n (length$ (find-all-facts ((?p plan)) TRUE)))"
        ' (printout t "plans " ?n crlf)'
        " (assert (plan (id X) (goal-id ?id)) (plan-action (id 1) (plan-id X) (goal-id ?id))"
        " (go-on ?id)))"
    )
    bench.env.build(
        "(defrule go-on ?f <- (go-on ?id) ?g <- (goal (id ?id)) =>"
        " (retract ?f) (modify ?g (mode FINISHED) (outcome FAILED)))"
    )
    grow(bench, "retry", "PLANNED", option="3")
    bench.tick()
    assert [text for text in bench.texts("I") if text.startswith("plans")] == ["plans 0"] * 3
    assert not bench.all("plan-action")


@pytest.mark.parametrize("kind", ["retry", "timeout"])
@pytest.mark.parametrize("params", ["", "max-tries", "max-tries three", "timeout -1.0", "max-tries 1 x 2"])
def test_invalid_parameters_fail_goal(bench: Bench, kind: str, params: str) -> None:
    bench.env.eval("(assert (goal (id C1) (class WILL-COMPLETED) (parent P)))")
    lone(bench, kind, params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    name, wanted = PREFIXES[kind], f"not (params {'max-tries N' if kind == 'retry' else 'timeout SECONDS'})"
    assert error(bench, "P") == ("INVALID-PARAMETERS", f"Invalid parameters for {name} goal 'P': {wanted}")


@pytest.mark.parametrize(("kind", "params"), [("retry", "max-tries 2"), ("timeout", "timeout 2.0")])
def test_second_child_fails_goal(bench: Bench, kind: str, params: str) -> None:
    for child in ("C1", "C2"):
        bench.env.eval(f"(assert (goal (id {child}) (class WILL-COMPLETED) (parent P)))")
    lone(bench, kind, params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    message = f"More than one sub-goal for {PREFIXES[kind]} goal 'P'"
    assert error(bench, "P") == ("TOO-MANY-SUBGOALS", message)
    assert selected(bench) == []


# --- timeout -----------------------------------------------------------------------------------------------


def test_timeout_fails_child_then_goal(bench: Bench) -> None:
    parent = grow(bench, "timeout", "HANGS", option="5.0")
    bench.tick()
    assert bench.state("C1")[0] == "SELECTED"
    assert bench.goal(parent)["meta"] == ("start-time", *divmod(bench.clock.now_us(), 1_000_000))
    bench.tick(5.0)
    assert bench.state("C1")[0] == "SELECTED"
    bench.tick(0.1)
    assert error(bench, "C1") == ("TIMEOUT", f"Parent {parent} set FAILED due to timeout")
    assert bench.state(parent) == ("FINISHED", "FAILED")
    assert error(bench, parent) == (
        "TIMEOUT",
        f"TIMEOUT goal '{parent}' sub-goal 'C1' FAILED (error TIMEOUT)",
    )


@pytest.mark.parametrize("outcome", ["FAILED", "REJECTED"])
def test_timeout_takes_outcome_of_child(bench: Bench, outcome: str) -> None:
    parent = grow(bench, "timeout", outcome, option="5.0")
    bench.tick()
    code = f"SUBGOAL-{outcome}"
    assert bench.state(parent) == ("FINISHED", outcome)
    assert error(bench, parent) == (
        code,
        f"TIMEOUT goal '{parent}' sub-goal 'C1' {outcome} (error {code})",
    )
