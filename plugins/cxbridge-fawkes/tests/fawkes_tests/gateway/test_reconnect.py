"""A gateway reconnects to a restarted server."""

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
    """A blackboard with a server that can stop and restart at the same address."""

    def __init__(self, kind, tmp_path):
        self.kind, self.path, self.port = kind, f"ipc://{tmp_path}/side", 0
        self.up()

    def up(self, prepare=lambda board: None):
        """Serve a new blackboard.

        :param prepare: prepares the blackboard before clients can connect.
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
    side = Side(request.param, tmp_path)
    yield side
    side.down()


@pytest.fixture
def local_board():
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        yield board


@pytest.fixture
def gateway(side, local_board):
    with ExitStack() as stack:
        remote = stack.enter_context(side.connect())
        gateway = stack.enter_context(Gateway(remote, local_board, ["SkillerInterface"], sweep_period_s=0.05))
        gateway.start()
        yield gateway


def shows(reader, text):
    reader.read()
    return reader.skill_string == text


def test_gateway_mirrors_interfaces_created_during_disconnection(side, local_board, gateway):
    """A disconnected client gets no events of created interfaces, on both sides."""
    side.board.open_for_writing(SkillerInterface, "old", owner="skiller")
    eventually(gateway.mirrors)
    side.down()
    eventually(lambda: not gateway.mirrors())
    local_writer = local_board.open_for_writing(SkillerInterface, "local", owner="skiller")
    local_writer.skill_string = "from local"
    local_writer.write()

    def open_remote_writer(board):
        remote_writer = board.open_for_writing(SkillerInterface, "remote", owner="skiller")
        remote_writer.skill_string = "from remote"
        remote_writer.write()

    side.up(open_remote_writer)
    eventually(lambda: {mirror.uid.partition("::")[2] for mirror in gateway.mirrors()} == {"local", "remote"})
    for board, id_, text in ((local_board, "remote", "from remote"), (side.board, "local", "from local")):
        reader = board.open_for_reading(SkillerInterface, id_, owner="test")
        eventually(partial(shows, reader, text))
        assert reader.writer == ("gateway" if board is local_board or side.kind == "zmq" else "remote")


def test_gateway_lists_interfaces_after_reconnection(side, local_board):
    """The gateway does not wait for the next periodic sweep."""
    with (
        side.connect() as remote,
        Gateway(remote, local_board, ["SkillerInterface"], sweep_period_s=3600) as gateway,
    ):
        side.board.open_for_writing(SkillerInterface, "old", owner="skiller")
        gateway.start()
        eventually(gateway.mirrors)
        side.down()
        eventually(lambda: not gateway.mirrors())
        side.up(lambda board: board.open_for_writing(SkillerInterface, "new", owner="skiller"))
        eventually(lambda: [mirror.uid for mirror in gateway.mirrors()] == ["SkillerInterface::new"])


def test_gateway_with_lost_connection_closes_without_request(side, local_board, gateway, monkeypatch):
    side.board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    eventually(gateway.mirrors)
    remote = gateway._boards[0]
    side.down()
    eventually(lambda: not remote.connected)
    eventually(lambda: not gateway.mirrors())
    requests = []
    monkeypatch.setattr(remote, "list", lambda *globs: requests.append(globs))
    gateway.request_sweep()
    gateway.close()
    assert requests == []
