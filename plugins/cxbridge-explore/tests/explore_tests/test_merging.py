"""States that are equal are visited once, and nothing that a run can come to is lost by that."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import pytest

from explore_tests.retrying import write_retrying
from explore_tests.test_explore import counts, explored
from tests.support import ROOT, share

SCENARIOS = ("test-scenario", "test-scenario-pddl", "waypoints")


def found_in(result: dict[str, Any]) -> tuple[set[str], set[str]]:
    return set(result["outcomes"]), {each["property"] for each in result["violations"]}


@pytest.mark.parametrize(
    ("scenario", "faults"), share(product(SCENARIOS, [1, 2]), 3, row=lambda case: case[0])
)
def test_shipped_scenarios_come_to_the_same_ends(scenario: str, faults: int):
    words = (ROOT / "scenarios" / scenario, "--faults", faults)
    merged, all_runs = explored(*words, status=None), explored(*words, "--no-merge", status=None)
    assert merged["complete"] is all_runs["complete"] is True
    assert found_in(merged) == found_in(all_runs)
    assert all_runs["merged"] == 0


def test_runs_that_come_to_the_same_state_are_merged(tmp_path: Path):
    words = (write_retrying(tmp_path / "retrying", skills=3), "--faults", "3")
    merged, all_runs = explored(*words), explored(*words, "--no-merge")
    assert found_in(merged) == found_in(all_runs)
    assert merged["not_merged"] == []
    assert merged["merged"] > 0
    assert merged["states"] < all_runs["states"] / 2
    # each edge leads to an end, to a new state or to a known one
    assert counts(merged) == counts(explored(*words, "--no-fork")) == counts(explored(*words, "--jobs", "3"))


def test_a_run_without_end_is_a_cycle(tmp_path: Path):
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
    found = explored(scenario, "--faults", "1", status=1)
    assert found["complete"] is True
    assert found["outcomes"]["endless"] >= 1
    assert [each["property"] for each in found["violations"]] == ["run-ends"]
    assert (
        "timed out"
        in explored(scenario, "--faults", "0", "--no-merge", "--timeout", "0.5", status=1)["outcomes"]
    )


def test_what_nobody_sees_is_not_merged():
    found = explored(ROOT / "scenarios" / "two-robots")
    assert found["merged"] == 0
    assert any("skill" in text for text in found["not_merged"])
