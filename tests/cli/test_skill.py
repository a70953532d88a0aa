"""The commands `cxbridge skill ...`, on a blackboard of this process."""

from __future__ import annotations

import _thread
import json

import pytest

from cxbridge.blackboard import EventKind, Listener
from cxbridge.cli.commands import skill
from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock
from cxbridge.interfaces import SkillerInterface
from cxbridge.skiller.simulation.deciders import Outcome
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge.skiller.status import Status
from tests.cli.boards import Looping, board_of, silent_bus, wait_for_control


class Estimator(StaticEstimator):
    """Skills called ``fail`` fail, skills called ``long`` take long, all further skills take no time."""

    def decide(self, call):
        if call.name == "fail":
            return Outcome(0.0, Status.S_FAILED, "on purpose")
        return Outcome(1000.0 if call.name == "long" else 0.0, Status.S_FINAL, "")


@pytest.fixture
def board(monkeypatch):
    with board_of(skill, monkeypatch) as board:
        yield board


@pytest.fixture
def skiller(board):
    bus = silent_bus()
    with Looping(lambda: SkillerSimulator(board, RealClock(), bus, [Estimator(seconds=0.0)])):
        yield board.open_for_reading(SkillerInterface, "Skiller", owner="test")


def run(*arguments):
    return invoke(["skill", *arguments])


def test_final_skill_is_status_0(skiller, capsys):
    assert run("exec", 'say{text="hi"}') == 0
    assert capsys.readouterr().out == "final\n"


def test_earlier_answer_with_same_message_id_is_ignored(skiller, capsys):
    """Every command's messages begin with id 1: the Skiller may still show the command before."""
    for skill_string, status in (("say{}", 0), ("fail{}", 1), ("say{}", 0), ("fail{}", 1), ("fail{}", 1)):
        assert run("exec", skill_string) == status


def test_failed_skill_is_status_1_with_reason(skiller, capsys):
    assert run("exec", "fail{}", "--json") == 1
    result = json.loads(capsys.readouterr().out)
    assert (result["outcome"], result["error"]) == ("failed", "on purpose")


def test_skill_timeout_stops_skill_and_is_status_3(skiller, capsys):
    assert run("exec", "long{}", "--timeout", "0.2") == 3
    assert capsys.readouterr().out == "timed out: not finished after 0.2 s\n"
    assert_stopped(skiller)


def assert_stopped(reader):
    """Wait for the end of control and skill."""
    wait_for_control(reader)
    assert reader.status == SkillerInterface.S_INACTIVE


def test_ctrl_c_stops_skill_and_is_status_130(board, skiller):
    pressed: list[bool] = []

    class Interrupt(Listener):
        def data_refreshed(self, interface):
            interface.read()
            if interface.status == SkillerInterface.S_RUNNING and not pressed:
                pressed.append(True)  # a second signal would arrive after the end of the command
                _thread.interrupt_main()

    board.register_listener(Interrupt(), skiller, EventKind.DATA_REFRESHED)
    assert run("exec", "long{}") == 130
    assert_stopped(board.open_for_reading(SkillerInterface, "Skiller", owner="after"))


def test_foreign_control_is_respected_unless_stolen(skiller, capsys):
    skiller.msgq_enqueue(SkillerInterface.AcquireControlMessage())
    wait_for_control(skiller, str(skiller.serial))
    assert run("exec", "say{}") == 1
    assert "has control of the Skiller" in capsys.readouterr().out
    assert run("exec", "say{}", "--steal") == 0


def test_missing_skiller_is_status_2(board, capsys):
    assert run("exec", "say{}") == 2
    assert "no Skiller writes SkillerInterface::Skiller" in capsys.readouterr().err
    assert run("list") == 0


def test_list_prints_skillers_and_skills(board, skiller, capsys):
    debug = board.open_for_writing("SkillerDebugInterface", "Skiller", owner="skiller")
    shown = []

    class Show(Listener):
        def message_received(self, interface, message):
            shown.append(message.graph_fsm)
            interface.graph_fsm = message.graph_fsm
            interface.graph = "say\nwait\n" if message.graph_fsm == "LIST" else ""
            interface.write()
            return False

    board.register_listener(Show(), debug)
    assert run("list") == 0
    assert capsys.readouterr().out.splitlines() == [
        "Skiller: S_INACTIVE '', controlled by nobody",
        "  say",
        "  wait",
    ]
    assert shown == ["LIST", "ACTIVE"]
    debug.close()
    assert run("list", "--json") == 0
    assert json.loads(capsys.readouterr().out)[0]["skills"] is None
