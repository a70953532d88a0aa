"""The executive drives a Skiller elsewhere: over ZeroMQ, over Fawkes' protocol, through a gateway."""

from __future__ import annotations

import threading
import time
from contextlib import ExitStack

import pytest

from cxbridge.blackboard import Listener, LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.result import FAULT
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_fawkes.gateway.service import run_gateway
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.remote_skiller import RemoteSkiller
from tests.cli.boards import WAIT_S, Looping
from tests.run.mini import write_scenario


class Robot(LocalBlackBoard):
    """A blackboard with a Skiller that works, and notes who its controllers were."""

    def __init__(self):
        super().__init__(InterfaceRegistry(), RealClock())


@pytest.fixture
def robot():
    with Robot() as board:
        bus = EventBus(RealClock())
        estimators = [StaticEstimator(seconds=0.05)]
        with Looping(lambda: SkillerSimulator(board, RealClock(), bus, estimators)):
            yield board


@pytest.fixture
def stack():
    with ExitStack() as made:
        yield made


def serve_zmq(stack, board, tmp_path, name="robot"):
    return stack.enter_context(ZmqBlackBoardServer(board, [f"ipc://{tmp_path}/{name}"])).endpoints[0]


def serve_fawkes(stack, board):
    return f"fawkes://127.0.0.1:{stack.enter_context(FawkesServer(board, port=0)).port}"


def gateway(stack, left, right):
    """Run a gateway until the end of the test."""
    ready, stops = threading.Event(), []

    def on_ready(stop):
        stops.append(stop)
        ready.set()

    thread = threading.Thread(
        target=run_gateway, args=((left, right), ["SkillerInterface"]), kwargs={"on_ready": on_ready}
    )
    thread.start()
    assert ready.wait(WAIT_S)

    def end():
        stops[0]()
        thread.join(WAIT_S)
        assert not thread.is_alive()

    stack.callback(end)


def drive(tmp_path, url):
    before = set(threading.enumerate())
    result = run_scenario(
        RunOptions(scenario=write_scenario(tmp_path / "s"), skiller=url, clock="real", timeout=WAIT_S)
    )
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    # those that end during this test belong to earlier tests
    assert not set(threading.enumerate()) - before


@pytest.mark.parametrize("transport", ["zmq", "fawkes"])
def test_a_run_drives_the_skiller_there(robot, stack, tmp_path, transport):
    url = serve_zmq(stack, robot, tmp_path) if transport == "zmq" else serve_fawkes(stack, robot)
    with robot.open_for_reading(SkillerInterface, "Skiller", owner="test") as watch:
        drive(tmp_path, url)
        watch.read()
        assert watch.skill_string == 'say{text="hello", wait=true}'


def test_a_run_drives_a_fawkes_skiller_through_a_gateway_and_zeromq(robot, stack, tmp_path):
    middle = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
    endpoint = serve_zmq(stack, middle, tmp_path, "middle")
    gateway(stack, endpoint, serve_fawkes(stack, robot))
    drive(tmp_path, endpoint)


@pytest.mark.parametrize("transport", ["zmq", "fawkes"])
def test_a_run_ends_when_the_skiller_is_gone(stack, tmp_path, transport):
    """It used to wait for the end of a skill that is not executed any more, until its time was over."""
    board = stack.enter_context(Robot())
    bus, estimators = EventBus(RealClock()), [StaticEstimator(seconds=1000)]
    stack.enter_context(Looping(lambda: SkillerSimulator(board, RealClock(), bus, estimators)))
    if transport == "zmq":
        server: ZmqBlackBoardServer | FawkesServer = ZmqBlackBoardServer(
            board, [f"ipc://{tmp_path}/robot"], heartbeat=0.1
        )
    else:
        server = FawkesServer(board, port=0)
    stack.enter_context(server)
    url = (
        server.endpoints[0]
        if isinstance(server, ZmqBlackBoardServer)
        else f"fawkes://127.0.0.1:{server.port}"
    )
    running = threading.Event()

    class Watch(Listener):
        def data_changed(self, interface):
            interface.read()
            if interface.status == SkillerInterface.S_RUNNING:
                running.set()

    board.register_listener(Watch(), board.open_for_reading(SkillerInterface, "Skiller", owner="test"))
    stopped_s = []

    def stop():
        if running.wait(WAIT_S):
            server.stop()
            stopped_s.append(time.monotonic())

    killer = threading.Thread(target=stop)
    killer.start()
    options = RunOptions(scenario=write_scenario(tmp_path / "s"), skiller=url, clock="real", timeout=3600)
    result = run_scenario(options)
    took_s = time.monotonic() - stopped_s[0]
    killer.join(WAIT_S)
    assert took_s < 4, "a question to the Skiller that is gone was waited for"
    assert result.status == FAULT
    assert result.reason.startswith(f"the Skiller at {url} is gone, and with it the skills under way")


def test_control_is_given_back_when_the_run_has_ended(robot, stack, tmp_path):
    with robot.open_for_reading(SkillerInterface, "Skiller", owner="test") as watch:
        drive(tmp_path, serve_zmq(stack, robot, tmp_path))
        for _ in range(WAIT_S * 100):
            watch.read()
            if watch.exclusive_controller == "":
                return
            threading.Event().wait(0.01)
        raise AssertionError(watch.exclusive_controller)


def test_control_is_given_back_when_a_fawkes_loads_its_skiller_again_after_the_run(stack):
    """Fawkes' new Skiller shows the controller of the old one, which has left between the two Skillers."""
    there, here = (stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock())) for _ in range(2))
    first = there.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    remote = RemoteSkiller("there:", here, EventBus(RealClock()), lambda _url: there)
    agent = here.open_for_reading(SkillerInterface, "Skiller", owner="agent")
    agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
    until(lambda: not first.msgq_empty())
    source = first.msgq_pop().source_id
    first.close()
    until(lambda: remote.loss_reason)
    closing = threading.Thread(target=remote.close)
    closing.start()
    second = there.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    second.exclusive_controller = str(source)
    second.write()
    until(lambda: not second.msgq_empty())
    message = second.msgq_pop()
    assert (message.type, message.source_id) == ("ReleaseControlMessage", source)
    closing.join(WAIT_S)


def until(condition):
    """Wait until a condition holds."""
    for _ in range(WAIT_S * 100):
        if condition():
            return
        threading.Event().wait(0.01)
    raise AssertionError("it did not come")


def test_without_a_skiller_there_it_says_so(stack, tmp_path):
    empty = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
    endpoint = serve_zmq(stack, empty, tmp_path)
    here = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
    from cxbridge.blackboard.urls import open_blackboard

    with pytest.raises(SkillerError, match="there is no Skiller at ipc://"):
        RemoteSkiller(
            endpoint,
            here,
            EventBus(RealClock()),
            lambda url: open_blackboard(url, InterfaceRegistry(), RealClock()),
            patience_s=0.01,
        )
    assert empty.list_all() == []


def test_a_virtual_clock_cannot_go_with_it(tmp_path):
    with pytest.raises(CxbridgeError) as caught:
        run_scenario(RunOptions(scenario=write_scenario(tmp_path), skiller="ipc:///x", clock="virtual"))
    assert "--clock virtual" in caught.value.message


def test_the_clock_is_real_with_a_url_unless_another_is_named():
    assert RunOptions(skiller="ipc:///x").clock_name == "real"
    assert RunOptions(skiller="ipc:///x", clock="virtual").clock_name == "virtual"
    assert RunOptions().clock_name == "virtual"
