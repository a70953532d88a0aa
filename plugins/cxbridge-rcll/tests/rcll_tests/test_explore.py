"""The exploration of a game, in which each call of a skill may fail."""

from __future__ import annotations

import pytest

from explore_tests.test_explore import run_explore
from rcll_tests.league import write_refbox, write_team


def test_exploration_lets_each_call_fail(tmp_path):
    team, refbox = write_team(tmp_path / "team"), write_refbox(tmp_path / "refbox")
    result = run_explore(
        "--overlay", team, "--refbox-dir", refbox, "--minutes", "1", "--lenient", status=None
    )
    assert result["complete"]
    assert result["states"] == result["runs"] - 1 > 1  # each call has one failure
    assert result["outcomes"] == {"timed out": result["runs"]}  # a game ends with the production
    assert "run-ends" not in {each["property"] for each in result["violations"]}
    assert not any(each["test"] for each in result["violations"])


def test_option_of_game_is_refused_for_scenario(tmp_path):
    with pytest.raises(AssertionError, match="--minutes applies only to games of the league"):
        run_explore("test-scenario", "--minutes", "1")
