"""The members that the plug-in adds to the fixture `cx`."""

from __future__ import annotations

import pytest

from tests.run.mini import write_scenario

pytest_plugins = ["pytester"]

TESTS = """
def test_each_failure_is_survived(cx):
    assert cx.explore("mini", "run-ends").outcomes == {"completed": 1, "unsuccessful": 1}


def test_no_goal_fails(cx):
    cx.explore("mini", "never (goal (outcome FAILED))", faults=1)
"""


def test_failed_exploration_prints_shortest_path(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the import of foreign plug-ins takes longer than the run
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    write_scenario(pytester.path / "mini", mapping="act: work{what=?(text)s}")
    pytester.makepyfile(test_explored=TESTS)
    result = pytester.runpytest_subprocess("-p", "cxbridge.pytest_plugin", "test_explored.py")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            "2 runs, 1 state, 0 merged: complete",
            "violated: never (goal (outcome FAILED)): *",
            "*work{*: fails*",
        ]
    )
