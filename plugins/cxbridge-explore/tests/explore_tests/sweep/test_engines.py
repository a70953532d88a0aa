"""Engines of sweeps with forks, processes, killed workers and endless rules."""

from __future__ import annotations

import os
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge_explore.sweep import engine as engine_module
from cxbridge_explore.sweep.engine import WorkerProcess, play_seeds
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import RunRow, SweepJob
from cxbridge_explore.worlds.points import RandomChooser
from tests.support import ROOT

JOB = SweepJob(RunOptions(scenario=ROOT / "scenarios" / "test-scenario", skiller="none"))
SEEDS = range(100, 108)


def without_times(row: RunRow) -> RunRow:
    return replace(row, cpu_seconds=0.0)


@pytest.fixture(scope="module")
def expected() -> list[RunRow]:
    """The row of each seed, played without a fork."""
    return [without_times(play_seed(JOB, seed, RandomChooser(seed))) for seed in SEEDS]


def test_worlds_differ_by_seed(expected):
    assert len({tuple(map(str, row.choices)) for row in expected}) > 2


@pytest.mark.parametrize("jobs", [1, 2])
def test_forked_run_equals_run_without_fork(expected, jobs):
    rows = [without_times(row) for row in play_seeds(JOB, SEEDS, jobs)]
    assert sorted(rows, key=lambda row: row.seed) == expected


def test_killed_workers_lose_no_row(expected, monkeypatch):
    pids: list[int] = []
    start = WorkerProcess.__init__

    def start_and_record(self: WorkerProcess, job: SweepJob) -> None:
        start(self, job)
        assert self.process.pid is not None
        pids.append(self.process.pid)

    monkeypatch.setattr(WorkerProcess, "__init__", start_and_record)
    monkeypatch.setattr(engine_module, "MAX_DEATHS", 100)
    rows = []
    for row in play_seeds(JOB, SEEDS, 2):
        rows.append(without_times(row))
        if len(rows) in (2, 5):
            os.kill(pids[-1], signal.SIGKILL)
    assert sorted(rows, key=lambda row: row.seed) == expected
    assert len(pids) > 2


def test_endless_run_crashes_and_sweep_continues(tmp_path):
    job = SweepJob(make_endless(tmp_path, "(plan-action (state FAILED))"), cpu_limit_s=1)
    outcomes = {row.seed: row.outcome for row in play_seeds(job, SEEDS[:2], 1)}
    assert set(outcomes.values()) == {"crashed", "completed"}


def test_scenario_that_reaches_no_skill_is_error(tmp_path):
    job = SweepJob(make_endless(tmp_path, "(time $?)"), cpu_limit_s=1)
    with pytest.raises(CxbridgeError, match="does not reach its first skill"):
        list(play_seeds(job, SEEDS, 1))


def make_endless(folder: Path, condition: str) -> RunOptions:
    """Return the test scenario with a rule that never ends."""
    copy = folder / "scenario"
    assert JOB.options.scenario is not None
    shutil.copytree(JOB.options.scenario, copy)
    with next(copy.glob("*.clp")).open("a") as file:
        file.write(f"(defrule spin {condition} => (while TRUE))")
    return replace(JOB.options, scenario=copy)


def test_invalid_scenario_is_error_with_file(tmp_path):
    (tmp_path / "scenario.yaml").write_text("clips-executive: {spec: nope}\n")
    job = SweepJob(RunOptions(scenario=tmp_path, skiller="none"))
    with pytest.raises(CxbridgeError, match="nope") as caught:
        list(play_seeds(job, SEEDS, 2))
    assert caught.value.file is not None
