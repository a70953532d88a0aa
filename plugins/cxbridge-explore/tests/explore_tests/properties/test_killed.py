"""Properties of killed and restarted agents."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.run.result import RunResult
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.forms import read_property
from cxbridge_explore.properties.monitor import Monitor, Property, Violation
from cxbridge_explore.properties.reading import find_property
from cxbridge_explore.properties.tables import FactTables
from cxbridge_explore.worldmodel.model import DecisionTimes, Kill, WorldModel
from cxbridge_explore.worlds.points import ChoicePoint
from explore_tests.worlds.test_kinds import CALM
from tests.run.mini import write_scenario
from tests.support import ROOT, needs_plugin

pytestmark = needs_plugin("robot-memory")
OPTIONS = RunOptions(scenario=ROOT / "scenarios" / "two-agents", skiller="none", timeout=120.0)


class KillOnce:
    """Kills an agent at the first choice point after ``seconds``."""

    def __init__(self, agent: str, seconds: float) -> None:
        self._agent, self._seconds, self._is_done = agent, seconds, False

    def choose(self, point: ChoicePoint) -> int:
        if self._is_done or point.subject != self._agent or point.seconds < self._seconds:
            return 0
        self._is_done = True
        return 1


def play_killed(
    seconds: float,
    restart_after_s: float | None,
    properties: Sequence[Property],
    options: RunOptions = OPTIONS,
) -> tuple[RunResult, list[Violation]]:
    """Play a run in which the world kills robot1."""
    world = WorldModel(
        default_skill=CALM,
        kills=(Kill(times=DecisionTimes(period_s=0.2, end_s=10.0), restart_after_s=restart_after_s),),
    )
    with ExploredRun(options, properties, KillOnce("robot1", seconds), world=world) as run:
        return run.play().verdict, run.property_watch.violations


@pytest.mark.parametrize(("seconds", "restart_after_s"), [(0.4, None), (8.4, None), (8.4, 3.0)])
def test_killed_agent_holds_nothing(seconds: float, restart_after_s: float | None):
    result, violations = play_killed(seconds, restart_after_s, builtin_properties())
    assert result.word == "completed"
    # a weakness of the agent: the restarted robot1 fetches water a second time
    assert [each for each in violations if not each.action.startswith("fill")] == []


def test_monitor_gets_killed_and_restarted_agents():
    events: list[tuple[str, str]] = []

    class MembersMonitor(Monitor):
        def joined(self, tables: FactTables) -> None:
            events.append(("joined", tables.name))

        def left(self, tables: FactTables) -> None:
            events.append(("left", tables.name))
            assert tables not in self.scene.tables

    play_killed(3.0, 2.0, [Property("members", MembersMonitor, "the members")])
    assert events == [("joined", "robot1"), ("joined", "robot2"), ("left", "robot1"), ("joined", "robot1")]


@pytest.mark.parametrize(("restart_after_s", "count"), [(None, 0), (2.0, 1)])
def test_property_concerns_only_living_agents(restart_after_s: float | None, count: int):
    form = 'after (wm-fact (key cx identity) (value "robot1")) then (goal (class UNUSED))'
    _, violations = play_killed(3.0, restart_after_s, [read_property(form)])
    assert len(violations) == count


def test_run_is_not_stuck_before_restart_of_agent(tmp_path: Path):
    """No agent has a goal, so nothing happens before and after the restart of robot1."""
    folder = write_scenario(tmp_path / "idle", agent="; nothing\n")
    with (folder / "scenario.yaml").open("a") as file:
        file.write("cxbridge:\n  agents:\n    robot1: {}\n    robot2: {}\n")
    idle = RunOptions(scenario=folder, skiller="none", timeout=120.0)
    result, violations = play_killed(0.2, 20.0, [find_property("run-ends")], idle)
    assert result.word == "stuck"
    assert [each.seconds > 20.0 for each in violations] == [True]
    result, violations = play_killed(0.2, None, [find_property("run-ends")], idle)
    assert result.word == "stuck"
    assert [each.seconds < 20.0 for each in violations] == [True]
