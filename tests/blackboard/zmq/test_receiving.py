"""The two receiving threads of a client, with quick and slow listeners."""

from __future__ import annotations

import threading
import time

import pytest
import zmq

from cxbridge.blackboard import Listener
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from tests.blackboard.samples import SampleInterface
from tests.blackboard.zmq.support import LONG, bench, eventually

Reset = SampleInterface.MESSAGES["ResetMessage"]


@pytest.fixture
def served(tmp_path):
    with bench("ipc", tmp_path) as served:
        yield served


class Gate(Listener):
    """Reads each write, and blocks at the value ``wait_at``."""

    def __init__(self, wait_at: int = 0) -> None:
        self.wait_at = wait_at
        self.entered, self.resume = threading.Event(), threading.Event()
        self.seen: list[int] = []

    def data_changed(self, interface):
        interface.read()
        if interface.count == self.wait_at:
            self.entered.set()
            assert self.resume.wait(LONG)
        self.seen.append(interface.count)


def write(writer, counts) -> None:
    for count in counts:
        writer.count = count
        writer.write()


def test_dispatcher_receives_while_listeners_are_quick(served):
    client = served.client()
    reader = client.open_for_reading(SampleInterface, "a")
    eventually(lambda: not client._dispatcher.session_has_turn)
    gate = Gate()
    client.register_listener(gate, reader)
    write(served.client().open_for_writing(SampleInterface, "a"), range(1, 101))
    served.settle()
    assert gate.seen == list(range(1, 101))
    eventually(lambda: not client._dispatcher.session_has_turn)


def test_session_receives_while_listener_is_slow(served):
    client, other = served.client(), served.client()
    reader, unwatched = (client.open_for_reading(SampleInterface, "a") for _ in range(2))
    writer = other.open_for_writing(SampleInterface, "a")
    gate = Gate(wait_at=5)
    client.register_listener(gate, reader)
    for _ in range(3):
        skipped = client.skipped
        gate.seen.clear()
        gate.resume.clear()
        write(writer, range(1, 6))
        assert gate.entered.wait(LONG)
        gate.entered.clear()
        write(writer, range(6, 401))  # more than a window, so that the client returns credit
        other.flush()
        eventually(lambda: unwatched.read() and unwatched.count == 400)
        assert client._dispatcher.session_has_turn
        assert client.list_all()
        assert gate.seen == [1, 2, 3, 4]
        gate.resume.set()
        served.settle()
        assert (gate.seen[:5], set(gate.seen[5:])) == ([1, 2, 3, 4, 5], {400})
        assert len(gate.seen) + client.skipped - skipped == 400
        eventually(lambda: not client._dispatcher.session_has_turn)


def test_board_shuts_down_in_and_during_listener(served):
    other = served.client()
    writer = other.open_for_writing(SampleInterface, "a")
    ended = threading.Event()

    class ShutsDown(Listener):
        def data_changed(self, interface):
            first.shutdown()
            ended.set()

    first, second = served.client(), served.client()
    first.register_listener(ShutsDown(), first.open_for_reading(SampleInterface, "a"))
    gate = Gate(wait_at=1)
    second.register_listener(gate, second.open_for_reading(SampleInterface, "a"))
    write(writer, [1])
    assert ended.wait(LONG)
    assert gate.entered.wait(LONG)
    threading.Timer(0.05, gate.resume.set).start()
    second.shutdown()
    assert gate.seen == [1]
    served.settle()


@pytest.mark.parametrize("asks", [True, False], ids=["asks", "is slow"])
def test_turn_returns_to_session_if_lent_at_begin_of_listener(asks):
    is_awake, done = threading.Event(), threading.Event()
    receiver = EventReceiver("lent", lambda *_: None, zmq.Context.instance(), is_awake.set)
    turns = []

    def listener() -> None:
        receiver._is_idle = True  # as just before the thread takes a call from the queue
        receiver.lend_turn()
        assert not receiver.session_has_turn
        if asks:
            receiver.wait_until(is_awake.is_set, time.monotonic() + LONG)
        else:
            assert [receiver.take_turn_if_slow(), receiver.take_turn_if_slow()] == [True, False]
        turns.append(receiver.session_has_turn)
        done.set()

    receiver.put(listener)
    assert done.wait(2 * LONG)
    receiver.stop()
    assert turns == [True]
