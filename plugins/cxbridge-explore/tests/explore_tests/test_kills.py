"""Agents that are killed at each loop of a time: the whole is in docs/explore.md, a piece of it here."""

from __future__ import annotations

from pathlib import Path

from explore_tests.test_explore import explored
from tests.support import needs_plugin

pytestmark = needs_plugin("robot-memory")


def killed(folder: Path, begin: float, end: float, back: float | None = None) -> Path:
    """Write a world in which nothing else happens."""
    file = folder / "world.yaml"
    again = "" if back is None else f", back: {back}"
    file.write_text(
        f"otherwise: {{fails: []}}\nkilled:\n  - {{times: {{from: {begin}, until: {end}}}{again}}}\n"
    )
    return file


def test_the_other_agent_goes_on(tmp_path: Path) -> None:
    found = explored("two-agents", "--world", killed(tmp_path, 2.0, 2.1))
    assert found["complete"]
    assert found["runs"] == found["states"] + 1 >= 7  # two agents, at least three loops, and the usual run
    assert found["outcomes"] == {"completed": found["runs"]}


def test_one_that_comes_back_fills_a_bucket_that_is_full(tmp_path: Path) -> None:
    """Its plan begins with it, and nothing in the agent looks whether it was done already."""
    found = explored("two-agents", "--world", killed(tmp_path, 7.2, 7.25, back=3.0), status=1)
    (violation,) = found["violations"]
    assert violation["property"] == "executed-once"
    assert violation["message"].startswith(
        "fill robot1 of CLEAN-hall starts, but fill robot1 of CLEAN-kitchen"
    )
    assert [each["option"] for each in violation["choices"]] == ["killed"]
