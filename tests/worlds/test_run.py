"""A run asks what its world does, and follows a path of choices."""

from __future__ import annotations

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.worlds.points import (
    Choice,
    ChoicePath,
    DivergedError,
    PathChooser,
    Step,
    UsualChooser,
    read_path,
)
from cxbridge.worlds.run import WorldResult, WorldRun
from tests.support import ROOT

OPTIONS = RunOptions(scenario=ROOT / "scenarios" / "test-scenario", skiller="none")


def played(path: ChoicePath) -> WorldResult:
    with WorldRun(OPTIONS, PathChooser(path)) as run:
        return run.play()


def test_each_call_of_a_skill_is_a_choice():
    with WorldRun(OPTIONS, UsualChooser()) as run:
        result = run.play()
    assert result.is_over
    assert result.choices
    assert {choice.taken.name for choice in result.choices} == {"succeeds"}
    assert all("Skiller: " in choice.point.subject for choice in result.choices)


def failing(choice: Choice) -> ChoicePath:
    return {choice.index: Step(choice.point.subject, "fails")}


def test_a_path_is_followed_and_can_be_written_and_read():
    usual = played({}).choices
    other = played(failing(usual[0])).choices
    assert other[0].taken.name == "fails"
    again = played(read_path([choice.as_dict() for choice in other])).choices
    assert again == other


def test_a_path_of_another_run_is_refused():
    with pytest.raises(DivergedError, match="was about"):
        played({0: Step("Skiller: nothing{}", "fails")})
