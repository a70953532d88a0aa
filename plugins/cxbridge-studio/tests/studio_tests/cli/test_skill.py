"""The commands `cxbridge skill monitor` and `skill graph`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock
from cxbridge.interfaces import SkillerInterface
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_studio.cli import skill
from tests.cli.boards import WAIT_S, Looping, SharedBoard, silent_bus
from tests.cli.test_skill import Estimator


@pytest.fixture
def board(monkeypatch):
    board = SharedBoard()
    monkeypatch.setattr(skill, "connect", lambda _url, _dirs: board)
    yield board
    assert board.left_open() == []
    board.shutdown()


@pytest.fixture
def skiller(board):
    bus = silent_bus()
    with Looping(lambda: SkillerSimulator(board, RealClock(), bus, [Estimator(seconds=0.0)])):
        yield board.open_for_reading(SkillerInterface, "Skiller", owner="test")


def run_skill(*arguments):
    return invoke(["skill", *arguments])


def test_monitor_prints_status_of_skill(skiller, capsys):
    skiller.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="fail{}"))
    assert run_skill("monitor", "--count", "1", "--timeout", str(WAIT_S)) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1
    assert run_skill("monitor", "--timeout", "0.2", "--json") == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["skill_string"] == "fail{}"


def test_graph_from_files_equals_graph_from_skiller(board, capsys):
    from cxbridge.skiller.make import make_lua_skiller

    assert run_skill("graph", "say") == 0
    from_files = capsys.readouterr().out
    assert from_files.startswith("digraph say {")
    with Looping(lambda: make_lua_skiller(board, RealClock(), silent_bus())):
        assert run_skill("graph", "say", "--connect", "tcp://x") == 0
    assert capsys.readouterr().out == from_files


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["graph", "sing"], "there is no skill 'sing' in the skill space 'test'"),
        (["graph", "say", "--connect", "tcp://x"], "no Skiller writes SkillerDebugInterface::Skiller"),
    ],
)
def test_unknown_skill_and_missing_skiller_are_errors(board, capsys, arguments, message):
    assert run_skill(*arguments) == 2
    assert message in capsys.readouterr().err
