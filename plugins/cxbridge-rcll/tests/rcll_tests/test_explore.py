"""A game of the league that is explored: each call of a skill may fail."""

from __future__ import annotations

import pytest

from explore_tests.test_explore import explored
from rcll_tests.league import write_refbox, write_team


def test_each_call_may_fail(tmp_path):
    team, refbox = write_team(tmp_path / "team"), write_refbox(tmp_path / "refbox")
    found = explored("--overlay", team, "--refbox-dir", refbox, "--minutes", "1", "--lenient", status=None)
    assert found["complete"]
    assert found["states"] == found["runs"] - 1 > 1  # one way to fail at each call
    assert found["outcomes"] == {"timed out": found["runs"]}  # a game is cut at the end of the production
    assert "run-ends" not in {each["property"] for each in found["violations"]}
    assert not any(each["test"] for each in found["violations"])


def test_what_only_a_game_has(tmp_path):
    with pytest.raises(AssertionError, match="--minutes applies only to games of the league"):
        explored("test-scenario", "--minutes", "1")
