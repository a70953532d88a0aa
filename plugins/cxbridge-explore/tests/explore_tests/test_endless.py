"""Runs in which a rule never comes to its end: they are given up, and reported; nothing waits for them."""

from __future__ import annotations

from pathlib import Path

import pytest

from explore_tests.test_explore import explored
from tests.run.mini import AGENT, write_scenario

PATIENCE = "0.4"
"""Many times the duration of the agent's loop, or of its start."""

HANG = "(defrule hang {when} => (while TRUE do (bind ?x 1)))"


@pytest.mark.parametrize(
    ("when", "completed"),
    [("(skill (status S_FAILED))", 1), ("(skill (status S_RUNNING))", 0), ("(goal (mode DISPATCHED))", 0)],
    ids=["after a fault", "in the usual run", "before the first choice"],
)
def test_a_rule_that_does_not_end(tmp_path: Path, when: str, completed: int) -> None:
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + HANG.format(when=when))
    found = explored(scenario, "--patience", PATIENCE, "--timeout", "60", status=1)
    assert found["outcomes"].get("completed", 0) == completed
    assert found["outcomes"]["timed out"] == found["runs"] - completed > 0
    (violation,) = found["violations"]
    assert violation["property"] == "run-ends"
    assert violation["message"].startswith(f"a loop has not ended within {PATIENCE} s")
    assert violation["recording"] is None


def test_an_agent_that_is_never_loaded(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + HANG.format(when="(executive-init)"))
    with pytest.raises(AssertionError, match=f"the agent has not loaded within {PATIENCE} s of proc"):
        explored(scenario, "--patience", PATIENCE)
