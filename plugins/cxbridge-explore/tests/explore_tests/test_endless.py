"""The exploration of agents with an endless action of a rule."""

from __future__ import annotations

from pathlib import Path

import pytest

from explore_tests.test_explore import run_explore
from tests.run.mini import AGENT, write_scenario

PATIENCE = "0.4"
"""Seconds: many times the duration of the agent's start or loop."""

HANG = "(defrule hang {when} => (while TRUE do (bind ?x 1)))"


@pytest.mark.parametrize(
    ("when", "completed"),
    [("(skill (status S_FAILED))", 1), ("(skill (status S_RUNNING))", 0), ("(goal (mode DISPATCHED))", 0)],
    ids=["after a fault", "in the usual run", "before the first choice"],
)
def test_endless_action_times_out_and_is_violation(tmp_path: Path, when: str, completed: int) -> None:
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + HANG.format(when=when))
    result = run_explore(scenario, "--patience", PATIENCE, "--timeout", "60", status=1)
    assert result["outcomes"].get("completed", 0) == completed
    assert result["outcomes"]["timed out"] == result["runs"] - completed > 0
    (violation,) = result["violations"]
    assert violation["property"] == "run-ends"
    assert violation["message"].startswith(f"a loop has not ended within {PATIENCE} s")
    assert violation["recording"] is None


def test_endless_loading_is_error(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + HANG.format(when="(executive-init)"))
    with pytest.raises(AssertionError, match=f"the agent has not loaded within {PATIENCE} s of proc"):
        run_explore(scenario, "--patience", PATIENCE)
