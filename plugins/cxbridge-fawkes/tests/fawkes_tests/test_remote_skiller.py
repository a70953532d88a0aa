"""The executive drives a remote Skiller over ZeroMQ and over Fawkes' protocol."""

from __future__ import annotations

import threading
from contextlib import ExitStack

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.run import RunOptions, run_scenario
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.remote_skiller import RemoteSkiller
from tests.blackboard.zmq.support import eventually
from tests.cli.boards import WAIT_S, Looping
from tests.run.mini import write_scenario


@pytest.fixture
def robot():
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        bus = EventBus(RealClock())
        estimators = [StaticEstimator(seconds=0.05)]
        with Looping(lambda: SkillerSimulator(board, RealClock(), bus, estimators)):
            yield board


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


def serve_zmq(stack, board, tmp_path, name="robot"):
    return stack.enter_context(ZmqBlackBoardServer(board, [f"ipc://{tmp_path}/{name}"])).endpoints[0]


def serve_fawkes(stack, board):
    return f"fawkes://127.0.0.1:{stack.enter_context(FawkesServer(board, port=0)).port}"


def run_remotely(tmp_path, url):
    before = set(threading.enumerate())
    result = run_scenario(
        RunOptions(scenario=write_scenario(tmp_path / "s"), skiller=url, clock="real", timeout=WAIT_S)
    )
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    # threads that end during this test belong to earlier tests
    assert not set(threading.enumerate()) - before


@pytest.mark.parametrize("transport", ["zmq", "fawkes"])
def test_run_drives_remote_skiller(robot, stack, tmp_path, transport):
    url = serve_zmq(stack, robot, tmp_path) if transport == "zmq" else serve_fawkes(stack, robot)
    with robot.open_for_reading(SkillerInterface, "Skiller", owner="test") as watch:
        run_remotely(tmp_path, url)
        watch.read()
        assert watch.skill_string == 'say{text="hello", wait=true}'


def test_closed_run_releases_control_of_reloaded_skiller(stack):
    """Fawkes' reloaded Skiller keeps the controller, which closes before the reload."""
    remote_board, local_board = (
        stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock())) for _ in range(2)
    )
    first = remote_board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    remote = RemoteSkiller("remote:", local_board, EventBus(RealClock()), lambda _url: remote_board)
    agent = local_board.open_for_reading(SkillerInterface, "Skiller", owner="agent")
    agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
    eventually(lambda: not first.msgq_empty())
    source = first.msgq_pop().source_id
    first.close()
    eventually(lambda: remote.loss_reason)
    closing = threading.Thread(target=remote.close)
    closing.start()
    second = remote_board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    second.exclusive_controller = str(source)
    second.write()
    eventually(lambda: not second.msgq_empty())
    message = second.msgq_pop()
    assert (message.type, message.source_id) == ("ReleaseControlMessage", source)
    closing.join(WAIT_S)


def test_board_without_skiller_is_error(stack, tmp_path):
    empty = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
    endpoint = serve_zmq(stack, empty, tmp_path)
    local_board = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
    from cxbridge.blackboard.urls import open_blackboard

    with pytest.raises(SkillerError, match="there is no Skiller at ipc://"):
        RemoteSkiller(
            endpoint,
            local_board,
            EventBus(RealClock()),
            lambda url: open_blackboard(url, InterfaceRegistry(), RealClock()),
            patience_s=0.01,
        )
    assert empty.list_all() == []


def test_remote_skiller_refuses_virtual_clock(tmp_path):
    with pytest.raises(CxbridgeError) as caught:
        run_scenario(RunOptions(scenario=write_scenario(tmp_path), skiller="ipc:///x", clock="virtual"))
    assert "--clock virtual" in caught.value.message


def test_clock_defaults_to_real_with_remote_skiller():
    assert RunOptions(skiller="ipc:///x").clock_name == "real"
    assert RunOptions(skiller="ipc:///x", clock="virtual").clock_name == "virtual"
    assert RunOptions().clock_name == "virtual"
