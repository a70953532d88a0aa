"""Every way that a run can go is found: by forking and by replaying, with one process and with several."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import pytest

from cxbridge.run.options import RunOptions
from cxbridge_explore.worlds.points import USUAL, ChoicePath, PathChooser, Step
from cxbridge_explore.worlds.run import WorldRun
from tests.forked import nursery
from tests.run.mini import write_scenario
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"
TIMES = ("cpu_seconds", "wall_seconds")


def explored(*words: object, status: int | None = 0, folder: Path = ROOT) -> dict[str, Any]:
    """Return the command's output as JSON.

    :param status: its exit status; None: whether a property is violated does not matter.
    """
    with tempfile.TemporaryDirectory() as out:
        done = nursery().run(["explore", *map(str, words), "--json", "--out", out], folder=folder)
    assert done.returncode in ((0, 1) if status is None else (status,)), done.stderr.decode()
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def counts(found: dict[str, Any]) -> dict[str, Any]:
    assert all(found[name] > 0 for name in TIMES)
    for each in found["violations"]:
        each["recording"] = each["test"] = None  # in a folder that is gone
    return {name: value for name, value in found.items() if name not in TIMES}


def enumerated(faults: int) -> tuple[int, int]:
    """Return how many runs and choice points there are: each path is played from its start."""
    options = RunOptions(scenario=SCENARIO, skiller="none")
    waiting: list[tuple[ChoicePath, int, int]] = [({}, 0, 0)]
    runs = points = 0
    while waiting:
        path, free, used = waiting.pop()
        with WorldRun(options, PathChooser(path)) as run:
            choices = run.play().choices
        runs += 1
        for choice in choices[free:]:
            points += 1
            for number, option in enumerate(choice.point.options):
                if number != USUAL and used + option.faults <= faults:
                    step = Step(choice.point.subject, option.name)
                    waiting.append(
                        ({**path, choice.point.index: step}, choice.point.index + 1, used + option.faults)
                    )
    return runs, points


@pytest.fixture(name="with_two", scope="module")
def _with_two() -> dict[str, Any]:
    """The findings with two faults, by the usual means."""
    return explored(SCENARIO, "--faults", "2")


@pytest.mark.parametrize("faults", [0, 1, 2])
def test_all_runs_are_found(faults: int, request: pytest.FixtureRequest):
    found = request.getfixturevalue("with_two") if faults == 2 else explored(SCENARIO, "--faults", faults)
    assert found["complete"] is True
    assert found["violations"] == []
    runs, points = enumerated(faults)
    assert (found["runs"], found["states"], found["merged"]) == (runs, points, 0)
    assert sum(found["outcomes"].values()) == runs


@pytest.mark.parametrize("means", [("--no-fork",), ("--jobs", "1"), ("--jobs", "4")], ids=" ".join)
def test_the_means_change_nothing(means: tuple[str, ...], with_two: dict[str, Any]):
    assert counts(explored(SCENARIO, "--faults", "2", *means)) == counts(with_two)


def test_beyond_the_depth_all_is_as_usual():
    assert explored(SCENARIO, "--depth", "0")["runs"] == 1
    assert explored(SCENARIO, "--depth", "2")["runs"] == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--faults", "-1"), "--faults"),
        (("--patience", "0"), "--patience cannot be 0"),
        (("--timeout", "0"), "--timeout"),
        (("--spec", "nothing"), "nothing"),
    ],
)
def test_bad_input_is_one_error(words: tuple[str, ...], message: str):
    done = nursery().run(["explore", str(SCENARIO), *words])
    said = done.stderr.decode()
    assert done.returncode == 2
    assert message in said
    assert "Traceback" not in said


def test_a_broken_agent_is_bad_input(tmp_path: Path):
    scenario = write_scenario(
        tmp_path / "broken", agent="(defrule broken (no-such-fact ?x) => (no-such-function ?x))"
    )
    done = nursery().run(["explore", str(scenario)])
    assert done.returncode == 2
    assert "no-such-function" in done.stderr.decode()
