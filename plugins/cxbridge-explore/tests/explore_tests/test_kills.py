"""Explorations that kill agents in each loop of an interval, as in docs/explore.md."""

from __future__ import annotations

from pathlib import Path

from explore_tests.test_explore import run_explore
from tests.support import needs_plugin

pytestmark = needs_plugin("robot-memory")


def write_world(folder: Path, begin: float, end: float, restart_after_s: float | None = None) -> Path:
    """Write a world that only kills agents."""
    file = folder / "world.yaml"
    restart = "" if restart_after_s is None else f", back: {restart_after_s}"
    file.write_text(
        f"otherwise: {{fails: []}}\nkilled:\n  - {{times: {{from: {begin}, until: {end}}}{restart}}}\n"
    )
    return file


def test_second_agent_completes_after_kill(tmp_path: Path) -> None:
    result = run_explore("two-agents", "--world", write_world(tmp_path, 2.0, 2.1))
    assert result["complete"]
    assert result["runs"] == result["states"] + 1 >= 7  # two agents, at least three loops, and the usual run
    assert result["outcomes"] == {"completed": result["runs"]}


def test_restarted_agent_fills_full_bucket(tmp_path: Path) -> None:
    """The plan begins with `fill`, and the agent does not check for an earlier `fill`."""
    result = run_explore(
        "two-agents", "--world", write_world(tmp_path, 7.2, 7.25, restart_after_s=3.0), status=1
    )
    (violation,) = result["violations"]
    assert violation["property"] == "executed-once"
    assert violation["message"].startswith(
        "fill robot1 of CLEAN-hall starts, but fill robot1 of CLEAN-kitchen"
    )
    assert [each["option"] for each in violation["choices"]] == ["killed"]
