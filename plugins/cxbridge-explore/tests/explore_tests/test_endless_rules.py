"""Rules that have no end: each way to run an agent says so, and names the rules."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.client import read_status
from cxbridge.daemon.options import DaemonOptions
from cxbridge.executive.host import endless
from cxbridge.run import watchdog
from cxbridge.run.options import RunOptions
from cxbridge.run.result import FAULT
from cxbridge.run.run import run_scenario
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import SweepJob
from cxbridge_explore.worlds.points import PathChooser
from tests.daemon.test_daemon import connected, running
from tests.run.mini import AGENT, write_scenario
from tests.support import share

RING = "rules fire endlessly: ping ({file}:{line}) -> pong ({file}:{line}) -> ping"
PING = "(defrule ping ?f <- (ping ?n) => {more} (retract ?f) (assert (pong ?n)))"
PONG = " (defrule pong ?f <- (pong ?n) => (retract ?f) (assert (ping {n})))"
BEGIN = "(defrule first {when} => (assert (ping 0)))"
SHAPES = {
    "a ring": PING.format(more="") + PONG.format(n="?n"),
    "a ring that counts": PING.format(more="") + PONG.format(n="(+ ?n 1)"),
    "a ring that prints": PING.format(more='(printout error "ping" crlf)') + PONG.format(n="?n"),
}
MOMENTS = {
    "while it loads": "(executive-init)",
    "in the first loop": "(executive-initialized)",
    "while a skill runs": "(skill (status S_RUNNING))",
}


def agent(tmp_path: Path, shape: str, moment: str) -> tuple[Path, str]:
    """Write an agent; return it, and the expected message."""
    text = f"{AGENT}{BEGIN.format(when=MOMENTS[moment])}\n{SHAPES[shape]}\n"
    scenario = write_scenario(tmp_path / "mini", agent=text)
    line = text.splitlines().index(SHAPES[shape]) + 1
    return scenario, RING.format(file=scenario / "mini.clp", line=line)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lose patience soon: how long it takes is no matter here."""
    monkeypatch.setattr(endless, "ENDLESS", ((10_000, 0.1),))
    monkeypatch.setattr(watchdog, "SPIN_S", 0.3)
    monkeypatch.setattr(watchdog, "UNATTENDED_SPIN_S", 0.5)


@pytest.mark.parametrize(("shape", "moment"), share(product(SHAPES, MOMENTS), 4, row=lambda case: case[0]))
def test_a_run_and_a_sweep(tmp_path: Path, shape: str, moment: str) -> None:
    scenario, said = agent(tmp_path, shape, moment)
    result = run_scenario(RunOptions(scenario=scenario, skiller="simulator"))
    assert (result.status, result.reason) == (FAULT, said)
    row = play_seed(SweepJob(RunOptions(scenario=scenario, skiller="none")), 1, PathChooser({}))
    assert (row.outcome, row.reason) == ("fault", said)


def test_an_exploration_writes_the_counterexample(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The exploration forks from this process, and so has its patience."""
    scenario, said = agent(tmp_path, "a ring that counts", "while a skill runs")
    out = str(tmp_path / "out")
    assert invoke(["explore", str(scenario), "--property", "run-ends", "--out", out, "--json"]) == 1
    (violation,) = json.loads(capsys.readouterr().out)["violations"]
    assert said in violation["message"]
    assert Path(violation["recording"]).exists()
    assert said in Path(violation["test"]).read_text()


def test_a_daemon(tmp_path: Path) -> None:
    scenario, said = agent(tmp_path, "a ring", "in the first loop")
    settings: dict[str, Any] = {
        "fawkes/enable": False,
        "zmq/endpoints": [f"ipc://{tmp_path}/bb"],
        "on-failure": "continue",
    }
    options = DaemonOptions(config=scenario, settings=tuple(settings.items()))
    with running(options) as (daemon, lines, _), connected(daemon) as board:
        while said not in str(read_status(board)):
            pass
    assert any(said in line for line in lines)
