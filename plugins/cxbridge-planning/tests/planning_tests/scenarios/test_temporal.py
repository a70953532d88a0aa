"""The scenario `temporal`: two cooks execute a plan of a temporal planner."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.run import RunOptions, run_scenario
from cxbridge_planning.needs import Need
from cxbridge_planning.registry import make_planner, planner_names
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "temporal"
INSTALLED = [
    name
    for name in planner_names()
    if Need.TIME in make_planner(name).understands and not make_planner(name).unavailable_reason
]
pytestmark = pytest.mark.skipif(not INSTALLED, reason="pip install 'cxbridge-planning[engines]'")


def run(tmp_path, config="", **options):
    (tmp_path / "more.yaml").write_text(config or "a: 1")
    lines: list[Any] = []
    result = run_scenario(
        RunOptions(scenario=SCENARIO, config=tmp_path / "more.yaml", log=tmp_path / "log", **options),
        console=lines.append,
    )
    return result, (tmp_path / "log").read_text().splitlines()


def find_times(lines, text):
    """Return the times of the lines with a text, in seconds of the run."""
    return [
        float(line.split()[1][6:]) + 60 * float(line.split()[1][3:5]) - 2800 for line in lines if text in line
    ]


def test_parallel_actions_start_at_same_time(tmp_path):
    result, lines = run(tmp_path)
    assert (result.status, [goal.outcome for goal in result.goals]) == (0, ["COMPLETED"])
    first, second = find_times(lines, "executes 'prepare")
    assert first == second
    served = find_times(lines, "executes 'serve")
    assert len(served) == 2
    assert min(served) - first > 3.9
    assert not any("running longer" in line or "missed its dispatch" in line for line in lines)


def test_overrun_of_action_is_reported_once(tmp_path):
    cook = "{executors: {cook: {prepare: 5.0}}}"
    slow = f"skill-board: {{agents: {{ann: {cook}, ben: {cook}}}}}"
    result, lines = run(tmp_path, slow)
    assert result.status == 0
    reports = [line for line in lines if "running longer than expected (which was 4.0 sec)" in line]
    assert len(reports) == 2
    assert {time_s > 4.0 for time_s in find_times(lines, "running longer")} == {True}


def test_missed_start_of_action_is_reported_once(tmp_path):
    """The plan is suspended at the start of the serve actions, and continues later."""
    (tmp_path / "pause.clp").write_text("""
(defrule pause
  ?plan <- (plan (suspended FALSE) (start-time $?start&~:(eq ?start (create$ 0 0))))
  (not (paused $?))
  (time $?now&:(timeout ?now ?start 3.0))
  =>
  (modify ?plan (suspended TRUE)) (assert (paused ?now)))
(defrule go-on
  ?plan <- (plan (suspended TRUE))
  (paused $?since)
  (time $?now&:(timeout ?now ?since 4.0))
  =>
  (modify ?plan (suspended FALSE)))
""")
    more = """
clips-executive:
  specs:
    temporal:
      init:
        stage-3:
          - {name: domain, file: breakfast-domain.clp}
          - {name: goals, files: [breakfast-goals.clp, pause.clp]}
          - {name: selection, file: action-selection/temporal.clp}
          - {name: execution, file: skills-actions.clp}
          - {name: monitoring, file: execmon/temporal-missed-dispatch.clp}
"""
    result, lines = run(tmp_path, more, clips_dirs=(tmp_path,))
    assert result.status == 0
    missed = [line for line in lines if "missed its dispatch time" in line]
    assert len(missed) == 2
    assert all("Action serve" in line for line in missed)


def test_goal_fails_with_reason_without_temporal_planner(tmp_path):
    result, lines = run(tmp_path, "planner: {planner: pyperplan}")
    assert result.status == 1
    assert result.goals[0].error == "PLANNING FAILED"
    assert any("pyperplan does not support durative actions" in line for line in lines)
