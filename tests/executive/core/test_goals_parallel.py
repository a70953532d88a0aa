"""Goals that pursue their sub-goals in parallel, in the built-in core."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import Symbol
from tests.executive.core.core_bench import Bench
from tests.executive.core.goal_bench import error, grow, selected


@pytest.mark.parametrize(
    ("children", "outcome", "blamed", "status_text"),
    [
        ("COMPLETED COMPLETED", "COMPLETED", "", ""),
        ("COMPLETED FAILED REJECTED", "FAILED", "C2", "has failed"),
        ("COMPLETED COMPLETED REJECTED", "REJECTED", "C3", "was rejected"),
    ],
)
def test_parallel_outcomes(bench: Bench, children: str, outcome: str, blamed: str, status_text: str) -> None:
    parent = grow(bench, "run-parallel", *children.split(), option="FAILED")
    bench.tick()
    assert sorted(selected(bench)) == [f"C{n}" for n, _ in enumerate(children.split(), 1)]
    assert bench.state(parent) == ("FINISHED", outcome)
    assert bench.goal(parent)["committed-to"] == Symbol("nil")
    expected = ("", "")
    if blamed:
        message = f"Sub-goal '{blamed}' of RUN-PARALLEL goal '{parent}' {status_text}"
        expected = (f"SUB-GOAL-{outcome} {blamed}", message)
    assert error(bench, parent) == expected


def test_parallel_selects_equal_priorities_at_once(bench: Bench) -> None:
    """No rule reacts to the first child before the last is selected."""
    bench.env.build(
        '(defrule late (goal (mode SELECTED) (parent ~nil) (id ?id)) => (printout t "late " ?id crlf))'
    )
    grow(bench, "run-parallel", "HANGS", "HANGS", "HANGS", option="NONE")
    bench.tick()
    words = [text.split()[0] for text in bench.texts("I")]
    assert words == ["selected"] * 3 + ["late"] * 3
    assert not bench.all("run-parallel-due")


@pytest.mark.parametrize(
    ("option", "first", "second_runs"),
    [
        ("NONE", "COMPLETED", True),
        ("NONE", "FAILED", False),
        ("NONE", "REJECTED", False),
        ("REJECTED", "REJECTED", True),
        ("REJECTED", "FAILED", False),
        ("FAILED", "FAILED", True),
        ("FAILED", "REJECTED", True),
    ],
)
def test_parallel_continue_on(bench: Bench, option: str, first: str, second_runs: bool) -> None:
    parent = grow(bench, "run-parallel-delayed", first, "COMPLETED", "COMPLETED", option=option)
    bench.tick()
    assert selected(bench) == (["C1", "C2", "C3"] if second_runs else ["C1"])
    assert bench.state("C3") == ("RETRACTED", "COMPLETED" if second_runs else "REJECTED")
    assert bench.state(parent) == ("FINISHED", first)


def test_parallel_next_batch_follows_dispatch(bench: Bench) -> None:
    grow(bench, "run-parallel-delayed", "HANGS", "HANGS", option="NONE")
    bench.tick()
    assert selected(bench) == ["C1"]
    bench.modify("goal", "(mode DISPATCHED)", id="C1")
    bench.tick()
    assert selected(bench) == ["C1", "C2"]


@pytest.mark.parametrize("outcome", ["FAILED", "REJECTED"])
def test_parallel_blames_first_finished_child(bench: Bench, outcome: str) -> None:
    """Fawkes' order of facts counts, in which the last changed fact is last."""
    parent = grow(bench, "run-parallel-delayed", "HANGS", "HANGS", "HANGS", option="FAILED")
    for child in ("C1", "C2", "C3"):
        bench.tick()
        bench.modify("goal", "(mode DISPATCHED)", id=child)
    for child in ("C2", "C3", "C1"):
        bench.modify("goal", f"(mode FINISHED) (outcome {outcome})", id=child)
        bench.tick()
    assert bench.state(parent) == ("FINISHED", outcome)
    assert error(bench, parent)[0] == f"SUB-GOAL-{outcome} C2"


def test_last_modified_goal_is_last_fact(bench: Bench) -> None:
    """As in CLIPS 6.30, where a goal that was modified is a new fact."""
    grow(bench, "run-all", "COMPLETED", "HANGS", "HANGS")
    bench.tick()
    assert [str(goal["id"]) for goal in bench.all("goal")] == ["C3", "C1", "RUN-ALL-ROOT-gen1", "C2"]
