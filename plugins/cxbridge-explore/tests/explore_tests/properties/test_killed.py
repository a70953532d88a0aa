"""An agent that is killed has no duties any more, and one that is back has all of them."""

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


class KillingOnce:
    """Kills an agent at the first choice point after a number of seconds."""

    def __init__(self, agent: str, seconds: float) -> None:
        self._agent, self._seconds, self._is_done = agent, seconds, False

    def choose(self, point: ChoicePoint) -> int:
        if self._is_done or point.subject != self._agent or point.seconds < self._seconds:
            return 0
        self._is_done = True
        return 1


def killed(
    seconds: float,
    back: float | None,
    properties: Sequence[Property],
    options: RunOptions = OPTIONS,
) -> tuple[RunResult, list[Violation]]:
    """Play a run in which robot1 is killed."""
    world = WorldModel(
        default_skill=CALM, kills=(Kill(times=DecisionTimes(period_s=0.2, end_s=10.0), restart_after_s=back),)
    )
    with ExploredRun(options, properties, KillingOnce("robot1", seconds), world=world) as run:
        return run.play().verdict, run.properties.violations


@pytest.mark.parametrize(("seconds", "back"), [(0.4, None), (8.4, None), (8.4, 3.0)])
def test_who_is_dead_holds_nothing(seconds: float, back: float | None):
    ended, violations = killed(seconds, back, builtin_properties())
    assert ended.word == "completed"
    # robot1 forgets that it has got water, and fetches some more: that is the agent's own weakness
    assert [each for each in violations if not each.action.startswith("fill")] == []


def test_monitors_see_who_is_killed_and_who_is_back():
    seen: list[tuple[str, str]] = []

    class Roll(Monitor):
        def joined(self, tables: FactTables) -> None:
            seen.append(("joined", tables.name))

        def left(self, tables: FactTables) -> None:
            seen.append(("left", tables.name))
            assert tables not in self.scene.tables

    killed(3.0, 2.0, [Property("roll", Roll, "a roll")])
    assert seen == [("joined", "robot1"), ("joined", "robot2"), ("left", "robot1"), ("joined", "robot1")]


@pytest.mark.parametrize(("back", "count"), [(None, 0), (2.0, 1)])
def test_a_form_expects_something_of_the_living_alone(back: float | None, count: int):
    form = 'after (wm-fact (key cx identity) (value "robot1")) then (goal (class NOBODY-HAS-IT))'
    _, violations = killed(3.0, back, [read_property(form)])
    assert len(violations) == count


def test_a_run_in_which_an_agent_will_be_back_is_not_stuck(tmp_path: Path):
    """Neither agent has a goal, so nothing happens until robot1 is back; and then nothing, too."""
    folder = write_scenario(tmp_path / "idle", agent="; nothing\n")
    with (folder / "scenario.yaml").open("a") as file:
        file.write("cxbridge:\n  agents:\n    robot1: {}\n    robot2: {}\n")
    idle = RunOptions(scenario=folder, skiller="none", timeout=120.0)
    ended, violations = killed(0.2, 20.0, [find_property("run-ends")], idle)
    assert ended.word == "stuck"
    assert [each.seconds > 20.0 for each in violations] == [True]
    ended, violations = killed(0.2, None, [find_property("run-ends")], idle)
    assert ended.word == "stuck"
    assert [each.seconds < 20.0 for each in violations] == [True]
