"""The command `cxbridge sweep`, as people and scripts use it."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"
RUNS = 6
FEW = ("--runs", str(RUNS), "--seed", "100", "--jobs", "2")


def ask(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    capsys.readouterr()
    status = invoke(["sweep", *map(str, words)])
    done = capsys.readouterr()
    return status, done.out, done.err


def swept(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    status, out, err = ask(capsys, SCENARIO, *FEW, "--json", *words)
    assert (status, err) == (0, "")
    found: dict[str, Any] = json.loads(out)
    return found


def timeless(found: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in found.items() if not key.endswith("_seconds")}


def test_what_scripts_get(capsys):
    found = swept(capsys, "--jobs", "1")
    assert (found["runs"], found["seed"]) == (RUNS, 100)
    assert sum(found["outcomes"].values()) == RUNS
    spans = found["makespan"]
    assert spans["min"] <= spans["p05"] <= spans["median"] <= spans["p95"] <= spans["max"]
    assert found["cpu_seconds"] > 0
    assert found["wall_seconds"] > 0
    assert timeless(swept(capsys)) == timeless(found)


def test_what_people_get(capsys):
    status, out, _ = ask(capsys, SCENARIO, *FEW)
    assert status == 0
    assert f" of {RUNS}" in out.splitlines()[0]
    assert "makespan of completed runs, seconds: min" in out
    assert "goal TESTGOAL-PARENT: " in out


def test_calls_that_can_only_succeed_are_counted(tmp_path: Path, capsys):
    (tmp_path / "world.yaml").write_text("otherwise:\n  fails: []\n")
    rows = tmp_path / "rows.csv"
    world = ("--world", tmp_path / "world.yaml", "--runs", "1", "--csv", rows)
    assert ask(capsys, ROOT / "scenarios" / "two-robots", *world)[0] == 0
    with rows.open() as file:
        (row,) = csv.DictReader(file)
    assert (row["calls"], row["faults"]) == ("8", "0")


def test_a_sweep_without_a_run_that_came_to_its_end_says_so(capsys):
    """Not one figure of it is one of the agent: a script must not take it for a success."""
    status, out, err = ask(capsys, SCENARIO, "--runs", "2", "--jobs", "1", "--timeout", "0.1")
    assert "timed out: 2 of 2" in out
    assert (status, err) == (
        1,
        f"{SCENARIO}: no run reached its end, so the sweep says nothing about the agent\n",
    )


def test_an_agent_differs_in_nothing_from_its_copy(capsys, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(SCENARIO, copy)
    compared = swept(capsys, "--against", copy)["comparison"]
    assert compared["completed"] == {"estimate": 0.0, "low": 0.0, "high": 0.0}
    assert compared["seeds"] == []


def test_a_table(capsys, tmp_path):
    found = swept(capsys, "--csv", tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["seed"]) for row in rows] == list(range(100, 100 + RUNS))
    assert sum(row["outcome"] == "completed" for row in rows) == found["outcomes"]["completed"]
    assert all(isinstance(json.loads(row["choices"]), list) for row in rows)


def test_what_was_played_is_not_played_again(capsys, tmp_path):
    kept = tmp_path / "kept.jsonl"
    whole = swept(capsys, "--resume", kept)
    lines = kept.read_text().splitlines(keepends=True)
    assert len(lines) == RUNS
    marked = lines[0].replace('"calls":', '"calls":1000, "was":')  # to be told from one that is played
    kept.write_text(marked + "".join(lines[1:3]) + lines[3][:20])  # killed in the middle of a line
    again = swept(capsys, "--resume", kept)
    assert again["calls"] > 1000
    assert again["outcomes"] == whole["outcomes"]
    assert len(kept.read_text().splitlines()) == RUNS


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--against", SCENARIO), "--against names the same agent"),
        (("--against", "nowhere"), "nowhere"),
        (("--csv", "/dev/null/a/rows.csv"), "/dev/null/a/rows.csv: cannot be written"),
        (("--resume", "nowhere/kept"), "nowhere/kept: cannot be used"),
        (("--runs", "0"), "--runs"),
    ],
)
def test_bad_input(capsys, words, complaint):
    status, out, err = ask(capsys, SCENARIO, *FEW, "--runs", "1", *words)
    assert (status, out) == (2, "")
    assert complaint in err
    assert "Traceback" not in err


def test_a_file_of_something_else_is_not_written_to(capsys, tmp_path):
    file = tmp_path / "notes"
    file.write_text("shopping\n")
    status, _, err = ask(capsys, SCENARIO, *FEW, "--resume", file)
    assert status == 2
    assert "notes:1: is not a row of a sweep" in err
    assert file.read_text() == "shopping\n"
