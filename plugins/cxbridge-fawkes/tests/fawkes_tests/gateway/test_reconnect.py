"""A gateway continues after the server of one of its sides was away."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge_fawkes.gateway import Gateway
from cxbridge_fawkes.network.server import FawkesServer
from tests.blackboard.zmq.support import eventually


class Side:
    """A blackboard behind a server that can die and come again at the same place."""

    def __init__(self, kind, tmp_path):
        self.kind, self.path, self.port = kind, f"ipc://{tmp_path}/side", 0
        self.up()

    def up(self, prepare=lambda board: None):
        """Serve a new blackboard.

        :param prepare: does something to it before anybody can connect.
        """
        self.board = LocalBlackBoard(InterfaceRegistry(), RealClock())
        prepare(self.board)
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
        made = stack.enter_context(Gateway(remote, here, ["SkillerInterface"], sweep_period_s=0.05))
        made.start()
        yield made


def shows(reader, text):
    reader.read()
    return reader.skill_string == text


def test_what_appeared_while_the_connection_was_away_is_mirrored(side, here, gateway):
    """On both sides: a client is not notified of interfaces that were made during its absence."""
    side.board.open_for_writing(SkillerInterface, "old", owner="skiller")
    eventually(gateway.mirrors)
    side.down()
    eventually(lambda: not gateway.mirrors())
    born_here = here.open_for_writing(SkillerInterface, "here", owner="skiller")
    born_here.skill_string = "from here"
    born_here.write()

    def before_the_server(board):
        born_there = board.open_for_writing(SkillerInterface, "there", owner="skiller")
        born_there.skill_string = "from there"
        born_there.write()

    side.up(before_the_server)
    eventually(lambda: {mirror.uid.partition("::")[2] for mirror in gateway.mirrors()} == {"here", "there"})
    for board, id_, text in ((here, "there", "from there"), (side.board, "here", "from here")):
        reader = board.open_for_reading(SkillerInterface, id_, owner="test")
        eventually(partial(shows, reader, text))
        assert reader.writer == ("gateway" if board is here or side.kind == "zmq" else "remote")


def test_a_gateway_lists_again_when_a_connection_is_back(side, here):
    """Without waiting for the next look."""
    with (
        side.connect() as remote,
        Gateway(remote, here, ["SkillerInterface"], sweep_period_s=3600) as gateway,
    ):
        side.board.open_for_writing(SkillerInterface, "old", owner="skiller")
        gateway.start()
        eventually(gateway.mirrors)
        side.down()
        eventually(lambda: not gateway.mirrors())
        side.up(lambda board: board.open_for_writing(SkillerInterface, "new", owner="skiller"))
        eventually(lambda: [mirror.uid for mirror in gateway.mirrors()] == ["SkillerInterface::new"])


def test_a_gateway_whose_side_is_away_ends_at_once(side, here, gateway, monkeypatch):
    """It used to wait for an answer of the side that was away."""
    side.board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    eventually(gateway.mirrors)
    remote = gateway._boards[0]
    side.down()
    eventually(lambda: not remote.connected)
    eventually(lambda: not gateway.mirrors())
    asked = []
    monkeypatch.setattr(remote, "list", lambda *globs: asked.append(globs))
    gateway.request_sweep()
    gateway.close()
    assert asked == []
