"""Scripted skills, and failures of the configuration, reach the executors of the skill board."""

from __future__ import annotations

import pytest

from cxbridge.events import SkillStatus
from cxbridge.run.options import RunOptions
from cxbridge.skiller.simulation.deciders import Outcome
from cxbridge.testing.agent_run import AgentRun
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "two-robots"
POSE = "Position3DInterface::Pose-robot1"


@pytest.fixture
def run():
    with AgentRun(RunOptions(scenario=SCENARIO, skiller="none"), scripted=True) as made:
        yield made


def failures(run: AgentRun) -> list[SkillStatus]:
    return [
        transition
        for transition in run.transitions
        if isinstance(transition, SkillStatus) and transition.status == "S_FAILED"
    ]


def error_of_first_failure(run: AgentRun) -> str:
    run.until(lambda: failures(run))
    return "".join(line.text for line in run.log if "lost" in line.text)


def test_script_fails_skill_of_executor(run):
    run.skills("move", to="lab").fails("lost", after=2.0, times=1)
    assert "lost" in error_of_first_failure(run)
    run.to_end()
    first = run.skills("move", to="lab").calls[0]
    assert first.skiller == "robot1"
    assert {goal.outcome for goal in run.goals("INSPECT")} >= {"COMPLETED"}


def test_robot_of_failed_skill_is_halfway(run):
    run.skills("move").fails("lost", after=2.0)
    run.until(lambda: run.skills("move").calls)
    run.advance(2.1)
    x, _, _ = run.read(POSE)["translation"]
    assert 0.8 < x < 1.2, "two seconds at half a metre a second"


def test_scripted_success_takes_time_without_movement(run):
    ends = []
    run.skills("move", to="lab").succeeds(after=3.0, then=lambda: ends.append(run.seconds))
    run.until(lambda: ends)
    assert ends == [pytest.approx(run.skills("move", to="lab").calls[0].seconds + 3.0, abs=0.1)]
    assert run.read(POSE)["translation"][0] == 0.0


def test_executors_execute_unscripted_skills(run):
    run.to_end()
    assert run.seconds == pytest.approx(45.0, abs=0.5)
    assert {call.skiller for call in run.skills.calls} == {"robot1", "robot2"}


def test_function_may_leave_call_to_executor(run):
    seen = []

    def answer(call):
        seen.append(call)
        return None if len(seen) > 1 else Outcome(0.5)

    run.skills("inspect").does(answer)
    run.until(lambda: len(seen) == 4)
    actions = [action for action in run.actions("inspect") if action.state == "FINAL"]
    assert len(actions) >= 3


def test_configured_failures_apply_to_executors(tmp_path):
    config = tmp_path / "failures.yaml"
    failure = "{name: move, args: [to=lab], calls: [1], error: lost, after: 0.5}"
    config.write_text(f"plugins/skiller-simulator: {{seed: 3, failures: {{lost: {failure}}}}}\n")
    options = RunOptions(scenario=SCENARIO, skiller="simulator", config=config)
    with AgentRun(options, scripted=False) as run:
        assert "lost" in error_of_first_failure(run)
        assert 4 < run.seconds < 16, "half the way to the lab"
        run.to_end()
        assert [each.skiller for each in failures(run)] == ["robot1", "robot2"], "the first call of each"
