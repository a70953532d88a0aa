"""A gateway goes on when the server of one of its sides was away."""

from __future__ import annotations

import threading
from contextlib import ExitStack

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.fawkesnet.server import FawkesServer
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.gateway import Gateway
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface

WAIT_S = 20


class Side:
    """A blackboard behind a server that can die and come again at the same place."""

    def __init__(self, kind, tmp_path):
        self.kind, self.path, self.port = kind, f"ipc://{tmp_path}/side", 0
        self.up()

    def up(self):
        self.board = LocalBlackBoard(InterfaceRegistry(), RealClock())
        if self.kind == "zmq":
            self.server: ZmqBlackBoardServer | FawkesServer = ZmqBlackBoardServer(
                self.board, [self.path], heartbeat=0.1
            )
            self.url = self.path
        else:
            self.server = FawkesServer(self.board, port=self.port)
            self.port = self.server.port
            self.url = f"fawkes://127.0.0.1:{self.port}"
        self.server.start()

    def down(self):
        self.server.stop()
        self.board.shutdown()

    def connect(self):
        return open_blackboard(self.url, InterfaceRegistry(), RealClock())


def until(condition):
    """Wait until a condition holds."""
    pause = threading.Event()
    for _ in range(WAIT_S * 50):
        if condition():
            return
        pause.wait(0.02)
    raise AssertionError("it did not come")


@pytest.fixture(params=["zmq", "fawkes"])
def side(request, tmp_path):
    made = Side(request.param, tmp_path)
    yield made
    made.down()


@pytest.fixture
def here():
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        yield board


@pytest.fixture
def gateway(side, here):
    with ExitStack() as stack:
        remote = stack.enter_context(side.connect())
        made = stack.enter_context(Gateway(remote, here, ["SkillerInterface"], sweep_s=0.05))
        made.start()
        yield made


def test_the_writer_there_dies_and_comes_again(side, here, gateway):
    reader = here.open_for_reading(SkillerInterface, "Skiller", owner="test")
    side.board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    until(lambda: reader.has_writer)
    side.down()
    until(lambda: not reader.has_writer)
    side.up()
    skiller = side.board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    skiller.skill_string = "again"
    skiller.write()
    until(lambda: reader.has_writer and reader.read() and reader.skill_string == "again")
    asked = reader.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="x"))
    until(lambda: not skiller.msgq_empty())
    message = skiller.msgq_pop()
    assert (message.skill_string, message.source_id) == ("x", reader.serial)
    skiller.msgid = message.id
    skiller.write()
    until(lambda: reader.read() and reader.msgid == asked)


def test_the_readers_there_get_the_data_again(side, here, gateway):
    skiller = here.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    skiller.skill_string = "kept"
    skiller.write()

    def arrived():
        with side.board.open_for_reading(SkillerInterface, "Skiller", owner="test") as reader:
            reader.read()
            return reader.has_writer and reader.skill_string == "kept"

    until(arrived)
    side.down()
    side.up()
    until(arrived)
