"""Engines play each seed once, whatever dies; the rows of a seed are the same wherever it is played."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge_explore.sweep import engine as engine_module
from cxbridge_explore.sweep.engine import Engine, LocalEngine, WorkerProcess
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import RunRow, SweepJob
from cxbridge_explore.worlds.points import RandomChooser
from tests.support import ROOT

JOB = SweepJob(RunOptions(scenario=ROOT / "scenarios" / "test-scenario", skiller="none"))
SEEDS = range(100, 108)


def timeless(row: RunRow) -> RunRow:
    return replace(row, cpu_seconds=0.0)


@pytest.fixture(scope="module")
def expected() -> list[RunRow]:
    """What each seed comes to when it is played alone, in a process that has forked nothing."""
    return [timeless(play_seed(JOB, seed, RandomChooser(seed))) for seed in SEEDS]


def played(engine: Engine, job: SweepJob = JOB) -> list[RunRow]:
    return sorted((timeless(row) for row in engine.play_seeds(job, SEEDS)), key=lambda row: row.seed)


def test_worlds_differ_by_seed(expected):
    assert len({tuple(map(str, row.choices)) for row in expected}) > 2


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_forked_run_is_as_one_that_is_loaded_for_itself(expected, jobs):
    assert played(LocalEngine(jobs)) == expected


def test_workers_that_are_killed_lose_nothing(expected, monkeypatch):
    pids: list[int] = []
    start = WorkerProcess.__init__

    def noted(self: WorkerProcess, job: SweepJob) -> None:
        start(self, job)
        pids.append(self.pid)

    monkeypatch.setattr(WorkerProcess, "__init__", noted)
    monkeypatch.setattr(engine_module, "MAX_DEATHS", 100)
    rows = []
    for row in LocalEngine(2).play_seeds(JOB, SEEDS):
        rows.append(timeless(row))
        if len(rows) in (2, 5):
            os.kill(pids[-1], signal.SIGKILL)
    assert sorted(rows, key=lambda row: row.seed) == expected
    assert len(pids) > 2


def test_a_run_that_never_ends_has_crashed_and_the_others_go_on(tmp_path):
    job = SweepJob(spinning(tmp_path, "(plan-action (state FAILED))"), cpu_seconds=1)
    outcomes = {row.seed: row.outcome for row in LocalEngine(1).play_seeds(job, SEEDS[:2])}
    assert set(outcomes.values()) == {"crashed", "completed"}


def test_a_scenario_that_never_comes_to_a_skill_is_an_error(tmp_path):
    job = SweepJob(spinning(tmp_path, "(time $?)"), cpu_seconds=1)
    with pytest.raises(CxbridgeError, match="does not reach its first skill"):
        list(LocalEngine(1).play_seeds(job, SEEDS))


def spinning(folder: Path, condition: str) -> RunOptions:
    """Return the test scenario with a rule that never ends."""
    copy = folder / "scenario"
    assert JOB.options.scenario is not None
    shutil.copytree(JOB.options.scenario, copy)
    with next(copy.glob("*.clp")).open("a") as file:
        file.write(f"(defrule spin {condition} => (while TRUE))")
    return replace(JOB.options, scenario=copy)


def test_a_wrong_scenario_is_an_error_with_its_place(tmp_path):
    (tmp_path / "scenario.yaml").write_text("clips-executive: {spec: nope}\n")
    job = SweepJob(RunOptions(scenario=tmp_path, skiller="none"))
    with pytest.raises(CxbridgeError, match="nope") as caught:
        list(LocalEngine(2).play_seeds(job, SEEDS))
    assert caught.value.file is not None


# ---- Dask


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


class Cluster:
    """A scheduler and its workers, as processes."""

    def __init__(self, folder: Path) -> None:
        pytest.importorskip("distributed", reason="needs distributed")
        self._folder = folder
        self.address = f"127.0.0.1:{free_port()}"
        self._port = self.address.partition(":")[2]
        self.processes = [self._start("scheduler", "--host", "127.0.0.1", "--port", self._port)]
        self.workers = [self.add_worker() for _ in range(2)]

    def _start(self, what: str, *arguments: str) -> subprocess.Popen[bytes]:
        with (self._folder / f"{what}.log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments, "--no-dashboard"],
                stdout=log,
                stderr=log,
                cwd=self._folder,
                env={**os.environ, "PYTHONPATH": ""},
            )

    def add_worker(self) -> subprocess.Popen[bytes]:
        worker = self._start(
            "worker", f"tcp://{self.address}", "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny"
        )
        self.processes.append(worker)
        return worker

    def close(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    found = Cluster(tmp_path)
    yield found
    found.close()


def test_a_cluster_plays_the_same_runs_whoever_is_killed(cluster, expected, monkeypatch):
    from cxbridge_explore.sweep import dask_engine

    monkeypatch.setattr(dask_engine, "_CHUNK_SEEDS", 2)
    rows = []
    with dask_engine.DaskEngine(cluster.address) as engine:
        for row in engine.play_seeds(JOB, SEEDS):
            rows.append(timeless(row))
            if len(rows) == 2:
                cluster.workers[0].kill()
                cluster.add_worker()
    assert sorted(rows, key=lambda row: row.seed) == expected


def test_no_scheduler_is_an_error(monkeypatch):
    pytest.importorskip("distributed", reason="needs distributed")
    from cxbridge_explore.sweep import dask_engine

    monkeypatch.setattr(dask_engine, "_CONNECT_TIMEOUT_S", 1)
    with pytest.raises(CxbridgeError, match="no Dask scheduler replies"):
        dask_engine.DaskEngine(f"127.0.0.1:{free_port()}")
