"""Explorations by fork and by replay, with a single process and with several."""

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


def run_explore(*words: object, status: int | None = 0, folder: Path = ROOT) -> dict[str, Any]:
    """Run `cxbridge explore`, and return its JSON output.

    :param status: the expected exit status; None allows a violated property.
    """
    with tempfile.TemporaryDirectory() as out:
        process = nursery().run(["explore", *map(str, words), "--json", "--out", out], folder=folder)
    assert process.returncode in ((0, 1) if status is None else (status,)), process.stderr.decode()
    result: dict[str, Any] = json.loads(process.stdout)
    return result


def without_times(result: dict[str, Any]) -> dict[str, Any]:
    assert all(result[name] > 0 for name in TIMES)
    for each in result["violations"]:
        each["recording"] = each["test"] = None  # in a removed folder
    return {name: value for name, value in result.items() if name not in TIMES}


def count_runs(faults: int) -> tuple[int, int]:
    """Return the numbers of runs and choice points, by playing each path from the start."""
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


@pytest.fixture(name="two_faults", scope="module")
def _two_faults() -> dict[str, Any]:
    """The result of an exploration with two faults and default options."""
    return run_explore(SCENARIO, "--faults", "2")


@pytest.mark.parametrize("faults", [0, 1, 2])
def test_exploration_finds_all_runs(faults: int, request: pytest.FixtureRequest):
    result = (
        request.getfixturevalue("two_faults") if faults == 2 else run_explore(SCENARIO, "--faults", faults)
    )
    assert result["complete"] is True
    assert result["violations"] == []
    runs, points = count_runs(faults)
    assert (result["runs"], result["states"], result["merged"]) == (runs, points, 0)
    assert sum(result["outcomes"].values()) == runs


@pytest.mark.parametrize("options", [("--no-fork",), ("--jobs", "1"), ("--jobs", "4")], ids=" ".join)
def test_execution_options_do_not_change_result(options: tuple[str, ...], two_faults: dict[str, Any]):
    assert without_times(run_explore(SCENARIO, "--faults", "2", *options)) == without_times(two_faults)


def test_depth_limits_choices():
    assert run_explore(SCENARIO, "--depth", "0")["runs"] == 1
    assert run_explore(SCENARIO, "--depth", "2")["runs"] == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--faults", "-1"), "--faults"),
        (("--patience", "0"), "--patience cannot be 0"),
        (("--timeout", "0"), "--timeout"),
        (("--spec", "nothing"), "nothing"),
    ],
)
def test_invalid_arguments_have_status_2(words: tuple[str, ...], message: str):
    process = nursery().run(["explore", str(SCENARIO), *words])
    errors = process.stderr.decode()
    assert process.returncode == 2
    assert message in errors
    assert "Traceback" not in errors


def test_broken_agent_has_status_2(tmp_path: Path):
    scenario = write_scenario(
        tmp_path / "broken", agent="(defrule broken (no-such-fact ?x) => (no-such-function ?x))"
    )
    process = nursery().run(["explore", str(scenario)])
    assert process.returncode == 2
    assert "no-such-function" in process.stderr.decode()
