"""The scenario `test-scenario-pddl`, and Fawkes' spec `test-pddl`."""

from __future__ import annotations

from tests.run.test_run import TEST_SCENARIO, bad, run
from tests.support import FAWKES_DIR, ROOT, needs_fawkes


def test_scenario_executes_planned_skills(tmp_path):
    """The scenario copies Fawkes' spec `test-pddl` and has the skill strings of the original mapping."""
    log = tmp_path / "log"
    result, _ = run(ROOT / "scenarios" / "test-scenario-pddl", log=log)
    assert (result.status, result.goals[0].goal) == (0, "TESTGOAL")
    executed = [line.split("executes ")[1] for line in log.read_text().splitlines() if "executes '" in line]
    assert executed == ["""'say{text="Hello PEGGY", wait=true}'""", """'say{text="Good bye", wait=true}'"""]


@needs_fawkes
def test_unchanged_fawkes_spec_executes_planned_skills(tmp_path, monkeypatch):
    """Rules of Fawkes generate the problem, call the planner and expand the goal, without FF."""
    monkeypatch.setenv("PATH", str(tmp_path))
    log = tmp_path / "log"
    result, _ = run(None, fawkes_dir=FAWKES_DIR, spec="test-pddl", log=log)
    assert (result.status, [goal.goal for goal in result.goals]) == (0, ["TESTGOAL"])
    lines = log.read_text().splitlines()
    executed = [line.split("executes ")[1] for line in lines if "executes '" in line]
    assert executed == ["""'say{text="Hello PEGGY", wait=true}'""", """'say{text="Good bye", wait=true}'"""]
    assert any("Goal 'TESTGOAL' has been completed, cleaning up" in line for line in lines)
    assert FAWKES_DIR
    assert not (FAWKES_DIR / "src/plugins/clips-executive/clips/test-scenario-pddl/problem.pddl").exists()


def test_invalid_planner_settings_are_reported_before_run(tmp_path):
    config = tmp_path / "planner.yaml"
    config.write_text("planner: {at-once: many}\n")
    assert "/planner/at-once" in str(bad(TEST_SCENARIO, config=config))
