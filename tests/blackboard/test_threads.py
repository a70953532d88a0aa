"""The local blackboard in several threads."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard, errors
from cxbridge.clock import RealClock
from cxbridge.events import BlockWrite, EventBus
from tests.blackboard.samples import SampleInterface, SampleRegistry


@pytest.fixture(autouse=True)
def fine_switching() -> Iterator[None]:
    """Switch between threads as often as Python allows."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.fixture
def board() -> LocalBlackBoard:
    return LocalBlackBoard(SampleRegistry(), RealClock())


def run_together(*jobs: Callable[[], None]) -> None:
    """Run each job in a thread; raise the error of the first failed job."""
    faults: list[BaseException] = []

    def guarded(job: Callable[[], None]) -> None:
        try:
            job()
        except BaseException as fault:  # noqa: BLE001 - raised again below
            faults.append(fault)

    threads = [threading.Thread(target=guarded, args=(job,)) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert not any(thread.is_alive() for thread in threads)
    if faults:
        raise faults[0]


def test_late_write_does_not_disturb_next_writer(board):
    reader = board.open_for_reading(SampleInterface, "a")
    late = board.open_for_writing(SampleInterface, "a")
    late.count = 1
    port = late._port  # as another thread has it during write()
    late.close()
    writer = board.open_for_writing(SampleInterface, "a")
    writer.count = 2
    writer.write()
    with pytest.raises(errors.InvalidInstanceError):
        port.publish(late, late._buf, True, True)
    reader.read()
    assert reader.count == 2


def test_messages_of_each_sender_arrive_once_and_in_order(board):
    senders = 4
    each = 1500
    writer = board.open_for_writing(SampleInterface, "a", queue_limit=senders * each)
    got: dict[object, list[int]] = {}

    def send() -> None:
        reader = board.open_for_reading(SampleInterface, "a")
        for count in range(each):
            assert reader.msgq_enqueue(SampleInterface.SetCountMessage(count)) == count + 1

    def receive() -> None:
        taken = 0
        while taken < senders * each:
            message = writer.msgq_pop()
            if message is not None:
                taken += 1
                got.setdefault(message.sender_id, []).append(message.count)

    run_together(receive, *[send] * senders)
    assert len(got) == senders
    assert all(counts == list(range(each)) for counts in got.values())
    assert writer.msgq_empty()


def test_interface_has_at_most_one_writer(board):
    writing = threading.Semaphore(1)
    won = []

    def contend() -> None:
        for _ in range(200):
            try:
                writer = board.open_for_writing(SampleInterface, "a")
            except errors.WriterActiveError:
                continue
            assert writing.acquire(blocking=False), "two writers at once"
            writer.write()
            won.append(writer.serial)
            writing.release()
            writer.close()

    run_together(*[contend] * 4)
    assert won
    assert list(board.list_all()) == []


def test_later_listener_is_not_notified_of_readable_write(board):
    heard = []

    class Hears(Listener):
        def data_refreshed(self, interface):
            heard.append(interface.id)

    def join(event: object) -> None:  # called before the listeners, in place of another thread
        late = board.open_for_reading(SampleInterface, "a")
        assert late.read()
        board.register_listener(Hears(), late, EventKind.DATA_REFRESHED)

    writer = board.open_for_writing(SampleInterface, "a")
    bus = writer._port._bus = EventBus(board.clock)
    bus.subscribe(join, BlockWrite)
    board.register_listener(Listener(), writer, EventKind.DATA_REFRESHED)
    writer.count = 1
    writer.write()
    assert heard == []
