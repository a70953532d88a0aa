"""The command `cxbridge sweep`."""

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


def run_sweep(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    capsys.readouterr()
    status = invoke(["sweep", *map(str, words)])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def sweep_as_json(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    status, out, err = run_sweep(capsys, SCENARIO, *FEW, "--json", *words)
    assert (status, err) == (0, "")
    result: dict[str, Any] = json.loads(out)
    return result


def without_times(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if not key.endswith("_seconds")}


def test_sweep_prints_json(capsys):
    result = sweep_as_json(capsys, "--jobs", "1")
    assert (result["runs"], result["seed"]) == (RUNS, 100)
    assert sum(result["outcomes"].values()) == RUNS
    spans = result["makespan"]
    assert spans["min"] <= spans["p05"] <= spans["median"] <= spans["p95"] <= spans["max"]
    assert result["cpu_seconds"] > 0
    assert result["wall_seconds"] > 0
    assert without_times(sweep_as_json(capsys)) == without_times(result)


def test_sweep_prints_summary(capsys):
    status, out, _ = run_sweep(capsys, SCENARIO, *FEW)
    assert status == 0
    assert f" of {RUNS}" in out.splitlines()[0]
    assert "makespan of completed runs, seconds: min" in out
    assert "goal TESTGOAL-PARENT: " in out


def test_sweep_counts_calls_without_faults(tmp_path: Path, capsys):
    (tmp_path / "world.yaml").write_text("otherwise:\n  fails: []\n")
    rows = tmp_path / "rows.csv"
    world = ("--world", tmp_path / "world.yaml", "--runs", "1", "--csv", rows)
    assert run_sweep(capsys, ROOT / "scenarios" / "two-robots", *world)[0] == 0
    with rows.open() as file:
        (row,) = csv.DictReader(file)
    assert (row["calls"], row["faults"]) == ("8", "0")


def test_sweep_without_finished_run_has_status_1(capsys):
    """The figures do not describe the agent, so scripts must not count the sweep as a success."""
    status, out, err = run_sweep(capsys, SCENARIO, "--runs", "2", "--jobs", "1", "--timeout", "0.1")
    assert "timed out: 2 of 2" in out
    assert (status, err) == (
        1,
        f"{SCENARIO}: no run reached its end, so the sweep says nothing about the agent\n",
    )


def test_comparison_with_copy_has_no_difference(capsys, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(SCENARIO, copy)
    comparison = sweep_as_json(capsys, "--against", copy)["comparison"]
    assert comparison["completed"] == {"estimate": 0.0, "low": 0.0, "high": 0.0}
    assert comparison["seeds"] == []


def test_csv_has_row_of_each_seed(capsys, tmp_path):
    result = sweep_as_json(capsys, "--csv", tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["seed"]) for row in rows] == list(range(100, 100 + RUNS))
    assert sum(row["outcome"] == "completed" for row in rows) == result["outcomes"]["completed"]
    assert all(isinstance(json.loads(row["choices"]), list) for row in rows)


def test_resumed_sweep_plays_only_missing_seeds(capsys, tmp_path):
    resume_file = tmp_path / "kept.jsonl"
    complete = sweep_as_json(capsys, "--resume", resume_file)
    lines = resume_file.read_text().splitlines(keepends=True)
    assert len(lines) == RUNS
    marked = lines[0].replace(
        '"calls":', '"calls":1000, "was":'
    )  # distinguishes the kept row from a played row
    resume_file.write_text(
        marked + "".join(lines[1:3]) + lines[3][:20]
    )  # as after a kill during the write of a line
    resumed = sweep_as_json(capsys, "--resume", resume_file)
    assert resumed["calls"] > 1000
    assert resumed["outcomes"] == complete["outcomes"]
    assert len(resume_file.read_text().splitlines()) == RUNS


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
def test_invalid_arguments_have_status_2(capsys, words, complaint):
    status, out, err = run_sweep(capsys, SCENARIO, *FEW, "--runs", "1", *words)
    assert (status, out) == (2, "")
    assert complaint in err
    assert "Traceback" not in err


def test_foreign_resume_file_is_refused_and_kept(capsys, tmp_path):
    file = tmp_path / "notes"
    file.write_text("shopping\n")
    status, _, err = run_sweep(capsys, SCENARIO, *FEW, "--resume", file)
    assert status == 2
    assert "notes:1: is not a row of a sweep" in err
    assert file.read_text() == "shopping\n"
