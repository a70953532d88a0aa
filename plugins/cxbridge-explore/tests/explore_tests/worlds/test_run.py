"""A run asks what its world does, and follows a path of choices."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run.options import RunOptions
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_explore.worlds.points import (
    Choice,
    ChoicePath,
    DivergedError,
    PathChooser,
    Step,
)
from cxbridge_explore.worlds.run import WorldResult, WorldRun, read_scenario_world
from tests.support import ROOT

OPTIONS = RunOptions(scenario=ROOT / "scenarios" / "test-scenario", skiller="none")


def played(path: ChoicePath) -> WorldResult:
    with WorldRun(OPTIONS, PathChooser(path)) as run:
        return run.play()


def failing(choice: Choice) -> ChoicePath:
    return {choice.point.index: Step(choice.point.subject, "fails")}


def test_a_path_of_another_run_is_refused():
    with pytest.raises(DivergedError, match="was about"):
        played({0: Step("Skiller: nothing{}", "fails")})


def scenario(name: str) -> RunOptions:
    return RunOptions(scenario=ROOT / "scenarios" / name, skiller="none")


def test_calls_on_the_skill_board_are_choices():
    with WorldRun(scenario("two-robots"), PathChooser({})) as run:
        usual = run.play()
    subjects = [choice.point.subject for choice in usual.choices]
    assert subjects[:2] == ["robot1: move{to='lab'}", "robot2: move{to='store'}"]
    with WorldRun(scenario("two-robots"), PathChooser(failing(usual.choices[0]))) as run:
        other = run.play()
    assert other.is_over
    assert other.choices[1].point.subject == subjects[1]
    assert len(other.choices) > len(usual.choices), "the move is tried again"


def test_the_world_beside_a_shipped_scenario_that_is_named(monkeypatch, tmp_path):
    """Not the one of the folder that one happens to be in."""
    (tmp_path / "world.yaml").write_text("skills: [{name: zebra}]\n")
    monkeypatch.chdir(tmp_path)
    world = read_scenario_world(RunOptions(scenario=Path("workshop")))
    assert world == read_world(ROOT / "scenarios" / "workshop" / "world.yaml")
    assert read_scenario_world(RunOptions(scenario=Path("two-robots"))) == WorldModel()
