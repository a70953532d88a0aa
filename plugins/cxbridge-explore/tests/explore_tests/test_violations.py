"""Violated properties with the shortest path, a recording and a failing test."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from cxbridge.run.options import RunOptions
from cxbridge_explore.counterexample import shrink
from cxbridge_explore.counterexample_playing import NthChooser, play_run
from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.properties.reading import find_property
from explore_tests.pytest_files import run_pytest
from tests.forked import nursery
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"
PROPERTY = "no-failed-talk: never (goal (class TALK) (mode FINISHED) (outcome FAILED))"


def test_path_is_shortened_to_necessary_choices():
    def play(subset):
        violations = [Violation("p", "", 1.0)] if {("a", 0), ("c", 0)} <= subset.keys() else []
        return SimpleNamespace(choices=(), played=subset, violations=violations)

    shortest: Any = shrink({(name, 0): "fails" for name in "abc"}, play)
    assert shortest.played == {("a", 0): "fails", ("c", 0): "fails"}
    assert shrink({("a", 0): "fails", ("b", 0): "fails"}, play) is None


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    """The result of the command, and the folder of its files."""
    folder = tmp_path_factory.mktemp("explored")
    words = [str(SCENARIO), "--faults", "2", "--json", "--property", PROPERTY, "--out", str(folder)]
    process = nursery().run(["explore", *words])
    assert process.returncode == 1, process.stderr.decode()
    return json.loads(process.stdout), folder


def test_json_has_path_recording_and_test(explored):
    result, folder = explored
    (violation,) = result["violations"]
    assert violation["property"] == "no-failed-talk"
    assert [choice["option"] for choice in violation["choices"]] == ["fails"]
    assert violation["words"].startswith("Skiller: say{text='Hello peggy', wait=True} fails at ")
    assert Path(violation["recording"]) == folder / "no_failed_talk.mcap"
    assert Path(violation["test"]) == folder / "test_no_failed_talk.py"


def test_written_test_fails_with_property(explored, monkeypatch):
    _, folder = explored
    process = run_pytest(folder / "test_no_failed_talk.py", monkeypatch)
    output = process.stdout.decode()
    assert process.returncode == 1
    assert "1 failed" in output
    assert "no-failed-talk" in output


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("run-end", "there is no property 'run-end'"),
        ("newer (goal)", "a property must begin with"),
        ("never (gaol (mode FAILED))", "gaol"),
    ],
)
def test_invalid_property_has_status_2(text, complaint, capfd):
    assert invoke(["explore", str(SCENARIO), "--property", text]) == 2
    output = capfd.readouterr().err
    assert complaint in output
    assert "Traceback" not in output


def test_written_test_moves_with_project(tmp_path, monkeypatch):
    project = tmp_path / "before"
    shutil.copytree(SCENARIO, project / "agent")
    (project / "over.yaml").write_text("{}")
    options = ["--config", "over.yaml", "--clips-dir", "agent", "--property", PROPERTY, "--out", "tests"]
    process = nursery().run(["explore", "agent", *options], folder=project)
    assert process.returncode == 1, process.stderr.decode()
    assert (
        "no-failed-talk is violated: " in process.stderr.decode()
    )  # printed before the search for the counterexample
    moved = project.rename(tmp_path / "after")
    file = moved / "tests" / "test_no_failed_talk.py"
    assert str(tmp_path) not in file.read_text()
    assert "cx.run('../agent', clips_dirs=('../agent',), config=('../over.yaml',))" in file.read_text()
    process = run_pytest(file, monkeypatch)
    assert process.returncode == 1
    assert "no-failed-talk" in process.stdout.decode()


def test_move_to_current_place_is_not_second_execution():
    """The robot in the office and the robot on its way fail, so the first robot moves to the office."""
    options = RunOptions(scenario=ROOT / "scenarios" / "two-robots", skiller="none")
    faults = {("robot2: inspect{place='office'}", 0): "fails", ("robot1: move{to='office'}", 0): "fails"}
    played = play_run(options, [find_property("executed-once")], NthChooser(faults))
    assert [choice.taken_option.name for choice in played.choices].count("fails") == 2
    assert played.violations == ()
