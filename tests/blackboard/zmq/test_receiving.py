"""Which of a client's two threads receives: listeners are called at once, and hold nobody up."""

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
def made(tmp_path):
    with bench("ipc", tmp_path) as made:
        yield made


class Gate(Listener):
    """Reads each write, and waits where the test says so."""

    def __init__(self, wait_at: int = 0) -> None:
        self.wait_at = wait_at
        self.entered, self.go_on = threading.Event(), threading.Event()
        self.seen: list[int] = []

    def data_changed(self, interface):
        interface.read()
        if interface.count == self.wait_at:
            self.entered.set()
            assert self.go_on.wait(LONG)
        self.seen.append(interface.count)


def write(writer, counts) -> None:
    for count in counts:
        writer.count = count
        writer.write()


def test_the_dispatcher_receives_as_long_as_listeners_are_quick(made):
    client = made.client()
    reader = client.open_for_reading(SampleInterface, "a")
    eventually(lambda: not client._dispatcher.session_has_turn)
    gate = Gate()
    client.register_listener(gate, reader)
    write(made.client().open_for_writing(SampleInterface, "a"), range(1, 101))
    made.settle()
    assert gate.seen == list(range(1, 101))
    eventually(lambda: not client._dispatcher.session_has_turn)


def test_the_session_receives_while_a_listener_takes_its_time_and_gives_the_turn_back(made):
    client, other = made.client(), made.client()
    reader, unheard = (client.open_for_reading(SampleInterface, "a") for _ in range(2))
    writer = other.open_for_writing(SampleInterface, "a")
    gate = Gate(wait_at=5)
    client.register_listener(gate, reader)
    for _ in range(3):
        skipped = client.skipped
        gate.seen.clear()
        gate.go_on.clear()
        write(writer, range(1, 6))
        assert gate.entered.wait(LONG)
        gate.entered.clear()
        write(writer, range(6, 401))  # more than a window: credit goes back, too
        other.flush()
        eventually(lambda: unheard.read() and unheard.count == 400)
        assert client._dispatcher.session_has_turn
        assert client.list_all()
        assert gate.seen == [1, 2, 3, 4]
        gate.go_on.set()
        made.settle()
        assert (gate.seen[:5], set(gate.seen[5:])) == ([1, 2, 3, 4, 5], {400})
        assert len(gate.seen) + client.skipped - skipped == 400
        eventually(lambda: not client._dispatcher.session_has_turn)


def test_a_board_can_be_shut_down_by_its_listener_and_while_one_is_called(made):
    other = made.client()
    writer = other.open_for_writing(SampleInterface, "a")
    ended = threading.Event()

    class ShutsDown(Listener):
        def data_changed(self, interface):
            first.shutdown()
            ended.set()

    first, second = made.client(), made.client()
    first.register_listener(ShutsDown(), first.open_for_reading(SampleInterface, "a"))
    gate = Gate(wait_at=1)
    second.register_listener(gate, second.open_for_reading(SampleInterface, "a"))
    write(writer, [1])
    assert ended.wait(LONG)
    assert gate.entered.wait(LONG)
    threading.Timer(0.05, gate.go_on.set).start()
    second.shutdown()
    assert gate.seen == [1]
    made.settle()


@pytest.mark.parametrize("asks", [True, False], ids=["asks", "is slow"])
def test_the_turn_is_not_lost_when_it_is_lent_just_as_a_listener_begins(asks):
    looks, done = threading.Event(), threading.Event()
    receiver = EventReceiver("lent", lambda *_: None, zmq.Context.instance(), looks.set)
    mine = []

    def listener() -> None:
        receiver._is_idle = True  # taken out of the queue, and not yet noted that there is something to do
        receiver.lend_turn()
        assert not receiver.session_has_turn
        if asks:
            receiver.wait_until(looks.is_set, time.monotonic() + LONG)
        else:
            assert [receiver.check_listeners(), receiver.check_listeners()] == [True, False]
        mine.append(receiver.session_has_turn)
        done.set()

    receiver.put(listener)
    assert done.wait(2 * LONG)
    receiver.stop()
    assert mine == [True]
