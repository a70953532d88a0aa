"""The merging of equal states, and its result compared with that of all runs."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import pytest

from explore_tests.retrying import write_retrying
from explore_tests.test_explore import run_explore, without_times
from tests.support import ROOT, share

SCENARIOS = ("test-scenario", "test-scenario-pddl", "waypoints")


def outcomes_and_violations(result: dict[str, Any]) -> tuple[set[str], set[str]]:
    return set(result["outcomes"]), {each["property"] for each in result["violations"]}


@pytest.mark.parametrize(
    ("scenario", "faults"), share(product(SCENARIOS, [1, 2]), 3, row=lambda case: case[0])
)
def test_merging_keeps_outcomes_of_shipped_scenarios(scenario: str, faults: int):
    words = (ROOT / "scenarios" / scenario, "--faults", faults)
    merged, all_runs = run_explore(*words, status=None), run_explore(*words, "--no-merge", status=None)
    assert merged["complete"] is all_runs["complete"] is True
    assert outcomes_and_violations(merged) == outcomes_and_violations(all_runs)
    assert all_runs["merged"] == 0


def test_runs_with_equal_state_are_merged(tmp_path: Path):
    words = (write_retrying(tmp_path / "retrying", skills=3), "--faults", "3")
    merged, all_runs = run_explore(*words), run_explore(*words, "--no-merge")
    assert outcomes_and_violations(merged) == outcomes_and_violations(all_runs)
    assert merged["not_merged"] == []
    assert merged["merged"] > 0
    assert merged["states"] < all_runs["states"] / 2
    # each edge leads to an end, to a new state or to a known state
    assert (
        without_times(merged)
        == without_times(run_explore(*words, "--no-fork"))
        == without_times(run_explore(*words, "--jobs", "3"))
    )


def test_endless_run_is_cycle_and_violation(tmp_path: Path):
    scenario = write_retrying(tmp_path / "endless", skills=2, tries=1)
    agent = scenario / "mini.clp"
    text = agent.read_text()
    for old, new in (
        ("?t <- (tries ?n&:(< ?n 1))", "?t <- (tries ?)"),
        ("(tries (+ ?n 1))", "(tries 0)"),
        ("(mode RETRACTED) (outcome FAILED)", "(mode RETRACTED)"),
        ("(defrule clean\n", "(defrule clean (declare (salience 1000))\n"),
    ):
        assert old in text
        text = text.replace(old, new)
    agent.write_text(text)
    result = run_explore(scenario, "--faults", "1", status=1)
    assert result["complete"] is True
    assert result["outcomes"]["endless"] >= 1
    assert [each["property"] for each in result["violations"]] == ["run-ends"]
    assert (
        "timed out"
        in run_explore(scenario, "--faults", "0", "--no-merge", "--timeout", "0.5", status=1)["outcomes"]
    )


def test_states_of_executors_are_not_merged():
    result = run_explore(ROOT / "scenarios" / "two-robots")
    assert result["merged"] == 0
    assert any("skill" in text for text in result["not_merged"])
