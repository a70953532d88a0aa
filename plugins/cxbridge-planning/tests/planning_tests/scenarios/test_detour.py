"""scenarios/detour: a door falls shut while the robot drives, and the goal is planned again."""

from __future__ import annotations

from typing import Any

from cxbridge.run import RunOptions, run_scenario
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "detour"


def test_a_changed_world_is_planned_again_as_in_the_golden_run(cx):
    run = cx.run(SCENARIO)
    run.to_end()
    run.assert_golden()


def test_no_action_fails_and_the_second_plan_goes_round(tmp_path):
    log = tmp_path / "log"
    run_scenario(RunOptions(scenario=SCENARIO, log=log))
    text = log.read_text()
    assert "plan 'plan-1' is no longer valid: step 1, (drive office store): " in text
    assert "(door office store) is false" in text
    assert "Goal 'STORE' is planned again" in text
    assert "plan-2: PLANNED by pyperplan: 4 actions" in text


def test_without_checks_the_action_waits_for_the_door(tmp_path):
    """As in Fawkes: its precondition does not hold, and the run has nothing left to do."""
    (tmp_path / "off.yaml").write_text("planner: {check-plans: false}")
    lines: list[Any] = []
    result = run_scenario(
        RunOptions(scenario=SCENARIO, config=tmp_path / "off.yaml", timeout=30.0), console=lines.append
    )
    assert result.status != 0
    assert [goal.outcome for goal in result.goals] != ["COMPLETED"]
