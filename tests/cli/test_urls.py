"""`cxbridge bb` and `cxbridge skill` over the transports, as users have them."""

from __future__ import annotations

import json
import threading
from importlib.util import find_spec

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from tests.cli.boards import WAIT_S, Looping, silent_bus, wait_for_control
from tests.fawkes import TRANSPORT, fawkes_server


@pytest.fixture
def board():
    before = set(threading.enumerate())
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as made:
        yield made
    assert not set(threading.enumerate()) - before


@pytest.fixture(params=["ipc", "tcp", *TRANSPORT])
def url(request, board, tmp_path):
    if request.param == "fawkes":
        with fawkes_server(board) as fawkes:
            yield f"fawkes://127.0.0.1:{fawkes.port}"
    else:
        endpoint = f"ipc://{tmp_path}/bb" if request.param == "ipc" else "tcp://127.0.0.1:*"
        with ZmqBlackBoardServer(board, [endpoint]) as server:
            yield server.endpoints[0]


@pytest.fixture
def skiller(board):
    bus = silent_bus()
    with Looping(lambda: SkillerSimulator(board, RealClock(), bus, [StaticEstimator(seconds=0.01)])):
        yield


def run(url, *arguments):
    return invoke([*arguments, "--connect", url])


def test_list_show_set_and_watch(board, url, capsys):
    writer = board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    writer.msgid = 7
    writer.write()
    assert run(url, "bb", "list", "--json") == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["uid"], row["has_writer"]) == ("SkillerInterface::Skiller", True)
    assert run(url, "bb", "show", "SkillerInterface::Skiller", "--json") == 0
    assert json.loads(capsys.readouterr().out)["fields"]["msgid"] == 7
    assert run(url, "bb", "set", "SkillerInterface::Skiller", "msgid=8") == 2
    with board.open_for_reading("TestInterface", "T", owner="test") as reader:
        assert run(url, "bb", "set", "TestInterface::T", "result=5") == 0
        reader.read()
        assert reader.as_dict()["result"] == 5
    assert run(url, "bb", "watch", "*", "--timeout", "0.01") == 0


def test_messages_and_skills(board, url, skiller, capsys):
    target = "SkillerInterface::Skiller"
    assert run(url, "bb", "send", target, "ExecSkill", "skill_string=say{}", "--wait") == 0
    assert capsys.readouterr().out.startswith("1\n")
    for _ in range(3):
        assert run(url, "skill", "exec", "say{}", "--timeout", str(WAIT_S)) == 0
    assert capsys.readouterr().out == "final\n" * 3
    assert run(url, "skill", "list") == 0
    if find_spec("cxbridge_studio"):
        assert run(url, "skill", "monitor", "--count", "1") == 0
    with board.open_for_reading(SkillerInterface, "Skiller", owner="test") as reader:
        wait_for_control(reader)


def test_missing_server_is_one_message_and_status_2(tmp_path, capsys):
    assert invoke(["bb", "list", "--connect", f"ipc://{tmp_path}/bb"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("cxbridge: error: ")
    assert "Traceback" not in error
