"""Replays of runs with planners."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from cxbridge.events import Event, InterfaceMessage, PlannerCall
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from planning_tests.scenarios.test_temporal import INSTALLED
from tests.run.replay.test_run_replay import SCENARIOS, repeat, replay, rewrite
from tests.support import share


@pytest.fixture(scope="module")
def waypoints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a run with executors and a planner."""
    trace = tmp_path_factory.mktemp("waypoints") / "run.mcap"
    run_scenario(RunOptions(scenario=SCENARIOS / "waypoints", trace=trace))
    return trace


@pytest.mark.parametrize("name", share(["test-scenario-pddl", "waypoints", "temporal"], 2))
def test_replay_equals_run_in_each_loop(name: str, tmp_path: Path) -> None:
    if name == "temporal" and not INSTALLED:
        pytest.skip("pip install 'cxbridge-planning[engines]'")
    repeat(name, tmp_path)


def test_changed_skill_of_executor_is_divergence(waypoints: Path) -> None:
    def change(event: Event) -> Event:
        if (
            isinstance(event, InterfaceMessage)
            and event.message == "RequestMessage"
            and event.values["master"] == 3
        ):
            return replace(event, values=dict(event.values) | {"parameters": '{"to":"the moon"}'})
        return event

    result = replay(rewrite(waypoints, change))
    assert result.status == 1
    assert "SkillExecutorInterface::tb3-move, command number 3" in result.reason
    assert "the moon" in result.reason


def test_executors_need_no_recorded_messages(waypoints: Path) -> None:
    assert replay(rewrite(waypoints, lambda e: None if isinstance(e, InterfaceMessage) else e)).status == 0


def test_replay_uses_recorded_plans(waypoints: Path, tmp_path: Path) -> None:
    trace_file = tmp_path / "replay.mcap"

    def change(event: Event) -> Event:
        if isinstance(event, PlannerCall) and event.plan:
            return replace(event, reason="", plan=event.plan.replace("wp-init wp", "wp-init the-moon-"))
        return event

    result = replay(rewrite(waypoints, change), trace=trace_file)
    assert result.status == 1
    plans = [event.plan for event in open_run(trace_file) if isinstance(event, PlannerCall)]
    assert "the-moon-" in plans[-1]


def test_changed_problem_of_planner_is_divergence(waypoints: Path) -> None:
    def change(event: Event) -> Event:
        return replace(event, problem="(at moon)") if isinstance(event, PlannerCall) else event

    result = replay(rewrite(waypoints, change))
    assert result.status == 1
    assert "planner of executive, command number 1: expected plan for (at moon)" in result.reason
