"""The scenario `detour`: a door closes during a drive, and the goal gets a new plan."""

from __future__ import annotations

from typing import Any

from cxbridge.run import RunOptions, run_scenario
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "detour"


def test_changed_world_causes_new_plan_of_golden_run(cx):
    run = cx.run(SCENARIO)
    run.to_end()
    run.assert_golden()


def test_second_plan_takes_detour(tmp_path):
    log = tmp_path / "log"
    run_scenario(RunOptions(scenario=SCENARIO, log=log))
    text = log.read_text()
    assert "plan 'plan-1' is no longer valid: step 1, (drive office store): " in text
    assert "(door office store) is false" in text
    assert "Goal 'STORE' is planned again" in text
    assert "plan-2: PLANNED by pyperplan: 4 actions" in text


def test_action_waits_for_door_without_checks(tmp_path):
    """The precondition of the action is false, and the run stops, like in Fawkes."""
    (tmp_path / "off.yaml").write_text("planner: {check-plans: false}")
    lines: list[Any] = []
    result = run_scenario(
        RunOptions(scenario=SCENARIO, config=tmp_path / "off.yaml", timeout=30.0), console=lines.append
    )
    assert result.status != 0
    assert [goal.outcome for goal in result.goals] != ["COMPLETED"]
