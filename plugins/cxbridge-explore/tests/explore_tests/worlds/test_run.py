"""Choices of runs, and paths of choices."""

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


def play_path(path: ChoicePath) -> WorldResult:
    with WorldRun(OPTIONS, PathChooser(path)) as run:
        return run.play()


def failing_path(choice: Choice) -> ChoicePath:
    return {choice.point.index: Step(choice.point.subject, "fails")}


def test_path_of_different_run_is_refused():
    with pytest.raises(DivergedError, match="was about"):
        play_path({0: Step("Skiller: nothing{}", "fails")})


def scenario(name: str) -> RunOptions:
    return RunOptions(scenario=ROOT / "scenarios" / name, skiller="none")


def test_calls_on_skill_board_are_choices():
    with WorldRun(scenario("two-robots"), PathChooser({})) as run:
        usual = run.play()
    subjects = [choice.point.subject for choice in usual.choices]
    assert subjects[:2] == ["robot1: move{to='lab'}", "robot2: move{to='store'}"]
    with WorldRun(scenario("two-robots"), PathChooser(failing_path(usual.choices[0]))) as run:
        failed = run.play()
    assert failed.is_over
    assert failed.choices[1].point.subject == subjects[1]
    assert len(failed.choices) > len(usual.choices), "the agent retries the move"


def test_world_of_named_scenario_comes_from_its_folder(monkeypatch, tmp_path):
    """The world.yaml of the current folder is ignored."""
    (tmp_path / "world.yaml").write_text("skills: [{name: zebra}]\n")
    monkeypatch.chdir(tmp_path)
    world = read_scenario_world(RunOptions(scenario=Path("workshop")))
    assert world == read_world(ROOT / "scenarios" / "workshop" / "world.yaml")
    assert read_scenario_world(RunOptions(scenario=Path("two-robots"))) == WorldModel()
