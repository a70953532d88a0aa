"""Endless rules are an error with the names of the rules in runs, sweeps, explorations and daemons."""

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


def write_agent(tmp_path: Path, shape: str, moment: str) -> tuple[Path, str]:
    """Write an agent; return its scenario and the expected message."""
    text = f"{AGENT}{BEGIN.format(when=MOMENTS[moment])}\n{SHAPES[shape]}\n"
    scenario = write_scenario(tmp_path / "mini", agent=text)
    line = text.splitlines().index(SHAPES[shape]) + 1
    return scenario, RING.format(file=scenario / "mini.clp", line=line)


@pytest.fixture(autouse=True)
def short_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the limits, so that the tests are fast."""
    monkeypatch.setattr(endless, "ENDLESS_LIMITS", ((10_000, 0.1),))
    monkeypatch.setattr(watchdog, "SPIN_S", 0.3)
    monkeypatch.setattr(watchdog, "UNATTENDED_SPIN_S", 0.5)


@pytest.mark.parametrize(("shape", "moment"), share(product(SHAPES, MOMENTS), 4, row=lambda case: case[0]))
def test_endless_rules_are_fault_of_run_and_sweep(tmp_path: Path, shape: str, moment: str) -> None:
    scenario, message = write_agent(tmp_path, shape, moment)
    result = run_scenario(RunOptions(scenario=scenario, skiller="simulator"))
    assert (result.status, result.reason) == (FAULT, message)
    row = play_seed(SweepJob(RunOptions(scenario=scenario, skiller="none")), 1, PathChooser({}))
    assert (row.outcome, row.reason) == ("fault", message)


def test_endless_rules_are_violation_with_counterexample(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exploration forks from this process, and so inherits the short limits."""
    scenario, message = write_agent(tmp_path, "a ring that counts", "while a skill runs")
    out = str(tmp_path / "out")
    assert invoke(["explore", str(scenario), "--property", "run-ends", "--out", out, "--json"]) == 1
    (violation,) = json.loads(capsys.readouterr().out)["violations"]
    assert message in violation["message"]
    assert Path(violation["recording"]).exists()
    assert message in Path(violation["test"]).read_text()


def test_daemon_reports_endless_rules(tmp_path: Path) -> None:
    scenario, message = write_agent(tmp_path, "a ring", "in the first loop")
    settings: dict[str, Any] = {
        "fawkes/enable": False,
        "zmq/endpoints": [f"ipc://{tmp_path}/bb"],
        "on-failure": "continue",
    }
    options = DaemonOptions(config=scenario, settings=tuple(settings.items()))
    with running(options) as (daemon, lines, _), connected(daemon) as board:
        while message not in str(read_status(board)):
            pass
    assert any(message in line for line in lines)
