"""A violated property: the shortest path, a recording and a test that fails in the same way."""

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
from explore_tests.pytest_files import pytest_of
from tests.forked import nursery
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"
PROPERTY = "no-failed-talk: never (goal (class TALK) (mode FINISHED) (outcome FAILED))"


def test_a_path_is_shortened_to_the_choices_that_it_needs():
    def play(subset):
        violations = [Violation("p", "", 1.0)] if {("a", 0), ("c", 0)} <= subset.keys() else []
        return SimpleNamespace(choices=(), played=subset, violations=violations)

    shortest: Any = shrink({(name, 0): "fails" for name in "abc"}, play)
    assert shortest.played == {("a", 0): "fails", ("c", 0): "fails"}
    assert shrink({("a", 0): "fails", ("b", 0): "fails"}, play) is None


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    """The result of the command, and its folder."""
    folder = tmp_path_factory.mktemp("explored")
    words = [str(SCENARIO), "--faults", "2", "--json", "--property", PROPERTY, "--out", str(folder)]
    done = nursery().run(["explore", *words])
    assert done.returncode == 1, done.stderr.decode()
    return json.loads(done.stdout), folder


def test_scripts_get_the_path_the_recording_and_the_test(explored):
    found, folder = explored
    (violation,) = found["violations"]
    assert violation["property"] == "no-failed-talk"
    assert [choice["option"] for choice in violation["choices"]] == ["fails"]
    assert violation["words"].startswith("Skiller: say{text='Hello peggy', wait=True} fails at ")
    assert Path(violation["recording"]) == folder / "no_failed_talk.mcap"
    assert Path(violation["test"]) == folder / "test_no_failed_talk.py"


def test_the_test_fails_as_the_run_does(explored, monkeypatch):
    _, folder = explored
    done = pytest_of(folder / "test_no_failed_talk.py", monkeypatch)
    said = done.stdout.decode()
    assert done.returncode == 1
    assert "1 failed" in said
    assert "no-failed-talk" in said


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("run-end", "there is no property 'run-end'"),
        ("newer (goal)", "a property must begin with"),
        ("never (gaol (mode FAILED))", "gaol"),
    ],
)
def test_a_misspelt_property(text, complaint, capfd):
    assert invoke(["explore", str(SCENARIO), "--property", text]) == 2
    said = capfd.readouterr().err
    assert complaint in said
    assert "Traceback" not in said


def test_the_test_moves_with_its_project(tmp_path, monkeypatch):
    project = tmp_path / "here"
    shutil.copytree(SCENARIO, project / "agent")
    (project / "over.yaml").write_text("{}")
    options = ["--config", "over.yaml", "--clips-dir", "agent", "--property", PROPERTY, "--out", "tests"]
    done = nursery().run(["explore", "agent", *options], folder=project)
    assert done.returncode == 1, done.stderr.decode()
    assert "no-failed-talk is violated: " in done.stderr.decode()  # before its counterexample is sought
    moved = project.rename(tmp_path / "there")
    file = moved / "tests" / "test_no_failed_talk.py"
    assert str(tmp_path) not in file.read_text()
    assert "cx.run('../agent', clips_dirs=('../agent',), config=('../over.yaml',))" in file.read_text()
    done = pytest_of(file, monkeypatch)
    assert done.returncode == 1
    assert "no-failed-talk" in done.stdout.decode()


def test_a_move_to_where_a_robot_is_counts_as_nothing():
    """The office's robot fails there, the other one on its way: the first goes to the office once more."""
    options = RunOptions(scenario=ROOT / "scenarios" / "two-robots", skiller="none")
    faults = {("robot2: inspect{place='office'}", 0): "fails", ("robot1: move{to='office'}", 0): "fails"}
    played = play_run(options, [find_property("executed-once")], NthChooser(faults))
    assert [choice.taken_option.name for choice in played.choices].count("fails") == 2
    assert played.violations == ()
