"""Sessions that end and come again; readers that are slow; the server's own process beside its clients."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any, cast

import pytest

from cxbridge.blackboard import EventKind, Listener, errors
from cxbridge.blackboard.kit.errors import (
    DisconnectedError,
    EndpointError,
    ProtocolError,
    RequestTimeoutError,
)
from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.blackboard.zmq.wire.frames import Existence, ResultCode, Sync
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SampleInterface
from tests.blackboard.zmq.support import LONG, bench, eventually

Reset, SetCount = (SampleInterface.MESSAGES[name] for name in ("ResetMessage", "SetCountMessage"))


@pytest.fixture
def made(tmp_path):
    with bench("ipc", tmp_path) as made:
        yield made


def freeze(client) -> None:
    """Make a client fall silent, as a stopped process does."""
    client._session._keep_alive = lambda now, gap: None


# -- the server's own process


def test_what_the_servers_process_wrote_before_a_flush_is_there_after_it(made):
    writer = made.board.open_for_writing(SampleInterface, "a")
    client = made.client()
    reader = client.open_for_reading(SampleInterface, "a")
    really_drain = made.server.run_posted_calls
    requests = made.server._requests
    requests._loop = SimpleNamespace(
        is_current_thread=made.server.is_current_thread, post=made.server.post, run_posted_calls=really_drain
    )
    made.server.run_posted_calls = lambda: (
        None
    )  # as if there was a frame after each frame, and no time for it
    try:
        writer.count = 7
        writer.write()
        client.flush()
        assert reader.read()
        assert reader.count == 7
    finally:
        made.server.run_posted_calls, requests._loop = really_drain, made.server


def test_messages_between_local_and_remote_instances(made):
    client = made.client()
    for near, far in ((made.board, client), (client, made.board)):
        interface_id = type(near).__name__
        reader = near.open_for_reading(SampleInterface, interface_id)
        writer = far.open_for_writing(SampleInterface, interface_id, queue_limit=2)
        made.settle()
        message = SetCount(5)
        assert reader.msgq_enqueue(message) == 1
        got = writer.msgq_first()
        assert (got.count, got.id, got.sender_id, got.source_id) == (5, 1, reader.serial, reader.serial)
        assert message.enqueued
        reader.msgq_enqueue(SetCount(6))
        with pytest.raises(errors.QueueFullError, match="2 messages"):
            reader.msgq_enqueue(SetCount(7))
        assert writer.msgq_size() == 2
        writer.close()
        with pytest.raises(errors.NoWriterError):
            reader.msgq_enqueue(SetCount(8))


def test_what_cannot_be_sent_takes_no_number(made):
    client = made.client()
    (session,) = made.server._sessions.values()
    with pytest.raises(ProtocolError):
        session.send(Existence(True, "\udc80", ""))
    client.flush()
    assert made.server._sessions == {session.id: session}


def test_a_remote_listener_may_decline_a_local_message(made):
    client = made.client()
    reader = made.board.open_for_reading(SampleInterface, "a")
    writer = client.open_for_writing(SampleInterface, "a")

    class SaysNo(Listener):
        def message_received(self, interface, message):
            return False

    client.register_listener(SaysNo(), writer)
    message = Reset()
    reader.msgq_enqueue(message)
    assert not message.enqueued
    assert writer.msgq_empty()


def test_what_a_silent_client_had_is_released_within_three_heartbeats(tmp_path):
    with bench("tcp", tmp_path, heartbeat=0.2) as made:
        witness = made.client()
        reader = witness.open_for_reading(SampleInterface, "a")
        victim = made.client()
        writer = victim.open_for_writing(SampleInterface, "a", owner="victim")
        victim.open_for_reading(SampleInterface, "a")
        made.settle()
        log = Recorder()
        witness.register_listener(log, reader, EventKind.WRITER_REMOVED, EventKind.READER_REMOVED)
        freeze(victim)
        made.clients.remove(victim)
        eventually(lambda: len(log.log) == 2)
        victim.shutdown()
        assert {entry[0] for entry in log.log} == {"-writer", "-reader"}
        assert not reader.has_writer
        assert not writer.valid
        assert witness.open_for_writing(SampleInterface, "a").is_writer


def test_a_message_to_a_writer_that_dies_is_an_error_in_time(tmp_path):
    with bench("tcp", tmp_path, heartbeat=0.2) as made:
        reader = made.client().open_for_reading(SampleInterface, "a")
        victim = made.client()
        victim.open_for_writing(SampleInterface, "a")
        entered, leave = threading.Event(), threading.Event()

        def hang(writer: Any, frame: Any) -> tuple[ResultCode, int]:
            entered.set()
            leave.wait(LONG)
            return ResultCode.NO_WRITER, 0

        cast("Any", victim._interfaces._copies["SampleInterface", "a"]).queue_message = hang
        freeze(victim)
        started = time.monotonic()
        with pytest.raises((errors.NoWriterError, RequestTimeoutError)):
            reader.msgq_enqueue(Reset())
        assert time.monotonic() - started < 5
        assert entered.is_set()
        leave.set()


# -- losing the server


def restart(made, **options) -> None:
    """Stop the server and serve a new, empty blackboard at the same endpoint."""
    made.server.stop()
    made.board.shutdown()
    made.board = type(made.board)(made.board.registry, made.clock, made.bus)
    made.server = ZmqBlackBoardServer(made.board, made.server.endpoints, **options)
    made.server.start()


@pytest.fixture(params=["ipc", "tcp"])
def restartable(request, tmp_path):
    with bench(request.param, tmp_path) as made:
        yield made
        made.shut_down_clients()
        made.server.stop()


def test_after_a_restart_everything_goes_on(restartable):
    made = restartable
    near, far = made.client(), made.client()
    reader = near.open_for_reading(SampleInterface, "a", owner="r")
    writer = far.open_for_writing(SampleInterface, "a", owner="w")
    writer.count = 7
    writer.write()
    made.settle()
    assert reader.read()
    restart(made)
    started = time.monotonic()
    eventually(lambda: near.connected and far.connected and reader.has_writer)
    assert time.monotonic() - started < 2
    assert (reader.valid, writer.valid, reader.count, reader.readers) == (True, True, 7, ("r",))
    late = near.open_for_reading(SampleInterface, "a")
    eventually(late.read)
    assert late.count == 7
    writer.count = 8
    writer.write()
    made.settle()
    assert reader.read()
    assert reader.count == 8
    assert reader.msgq_enqueue(Reset()) == 1
    assert writer.msgq_size() == 1


def test_writes_without_a_server_are_kept_and_the_last_one_published(made):
    near, far = made.client(), made.client()
    reader = near.open_for_reading(SampleInterface, "a")
    writer = far.open_for_writing(SampleInterface, "a")
    endpoints = made.server.endpoints
    made.server.stop()
    eventually(lambda: not near.connected and not far.connected)
    assert not reader.has_writer
    for count in (1, 2, 3):
        writer.count = count
        writer.write()
    with pytest.raises(DisconnectedError, match="no connection"):
        near._sender.request(Sync(), timeout=0.05)
    made.server = ZmqBlackBoardServer(made.board, endpoints)
    with made.server:
        eventually(reader.read)
        assert reader.count == 3
        made.shut_down_clients()


def test_a_write_that_is_lost_with_its_session_is_sent_again(made):
    reader = made.client().open_for_reading(SampleInterface, "a")
    writer = made.client().open_for_writing(SampleInterface, "a")
    writer.count = 1
    writer.write()
    eventually(reader.read)
    requests = made.server._requests

    def lose_write(session, _frame):
        del requests._handle_write  # the next write is handled
        made.server._mark_failed(session, ResultCode.FRAME_LOST)

    requests._handle_write = lose_write
    writer.count = 2
    writer.write()
    eventually(reader.read)
    assert reader.count == 2


def test_listeners_and_observers_hear_of_the_loss_and_the_return(made):
    near, far = made.client(), made.client()
    reader = near.open_for_reading(SampleInterface, "a")
    far.open_for_writing(SampleInterface, "a")
    far.open_for_reading(SampleInterface, "b")
    made.settle()
    log = Recorder()
    near.register_listener(log, reader, EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED)
    near.register_observer(log)
    made.server.stop()
    eventually(lambda: log.log)
    assert log.take()[0][:2] == ("-writer", "SampleInterface::a")
    far.shutdown()
    with ZmqBlackBoardServer(made.board, made.server.endpoints):
        eventually(lambda: log.log)
        near.flush()
        assert log.take() == [("destroyed", "SampleInterface::b")]
        made.shut_down_clients()


def test_the_writer_that_comes_too_late_becomes_invalid(made):
    first = made.client()
    writer = first.open_for_writing(SampleInterface, "a", owner="first")
    lines = made.collect_lines()
    made.server.stop()
    made.board.open_for_writing(SampleInterface, "a", owner="second")
    with ZmqBlackBoardServer(made.board, made.server.endpoints):
        eventually(lambda: not writer.valid)
        with pytest.raises(errors.InvalidInstanceError):
            writer.write()
        eventually(lambda: first.connected)
        assert first.list_all()[0].writer == "second"
        assert any("could not be opened again: WRITER_ACTIVE" in line.text for line in lines)
        made.shut_down_clients()


def test_nobody_answers(tmp_path):
    from cxbridge.blackboard.zmq import ZmqBlackBoard
    from cxbridge.clock import VirtualClock
    from tests.blackboard.samples import SampleRegistry

    for url in (f"ipc://{tmp_path}/none", "tcp://127.0.0.1:1"):
        with pytest.raises(DisconnectedError, match="no blackboard replies at") as caught:
            ZmqBlackBoard(url, SampleRegistry(), VirtualClock(), connect_timeout=0.1)
        assert "'cxbridge daemon' starts a daemon" in str(caught.value)


def test_an_ipc_endpoint_that_somebody_serves_is_not_taken_over(made):
    """libzmq unlinks the socket of the server there, and binds."""
    server = ZmqBlackBoardServer(made.board, made.server.endpoints)
    with pytest.raises(EndpointError, match="another process serves ipc://"):
        server.start()
    assert made.client().connected


# -- slow readers


def test_a_stopped_reader_costs_a_window_and_gets_the_newest_value(tmp_path):
    with bench("ipc", tmp_path, window=8) as made:
        slow, quick = made.client(), made.client()
        slow_reader = slow.open_for_reading(SampleInterface, "a")
        quick_reader = quick.open_for_reading(SampleInterface, "a")
        writer = made.client().open_for_writing(SampleInterface, "a")
        go_on = threading.Event()
        really_take = slow._dispatcher._handle_message

        def take(data: bytes) -> None:
            go_on.wait(LONG)
            really_take(data)

        cast("Any", slow._dispatcher)._handle_message = take
        for count in range(1, 501):
            writer.count = count
            writer.write()
        made.clients[2].flush()
        quick.flush()
        assert quick_reader.read()
        assert quick_reader.count == 500
        (session,) = (s for s in made.server._sessions.values() if s.credit == 0)
        assert len(session.waiting_channels) == 1
        go_on.set()
        eventually(lambda: slow_reader.read() and slow_reader.count == 500)
        assert slow.skipped >= 400


def test_what_an_open_brings_up_to_date_counts_as_skipped_in_the_client_too(tmp_path):
    with bench("ipc", tmp_path, window=8) as made:
        slow = made.client()
        reader = slow.open_for_reading(SampleInterface, "a")
        writer = made.board.open_for_writing(SampleInterface, "a")
        cast("Any", slow._dispatcher)._give_credit = lambda: None
        for count in range(1, 51):
            writer.count = count
            writer.write()
        slow.flush()
        slow.open_for_reading(SampleInterface, "a")
        assert reader.read()
        assert reader.count == 50
        assert slow.skipped == 41


def test_a_listener_never_reads_older_data_than_were_read_before(made):
    client = made.client()
    reader = client.open_for_reading(SampleInterface, "a")
    writer = made.client().open_for_writing(SampleInterface, "a")
    entered, go_on, seen = threading.Event(), threading.Event(), []

    class Slow(Listener):
        def data_changed(self, interface):
            entered.set()
            go_on.wait(LONG)
            interface.read()
            seen.append(interface.count)

    client.register_listener(Slow(), reader)
    for count in (1, 2, 3):
        writer.count = count
        writer.write()
    made.clients[1].flush()
    client._sender.request(Sync(), timeout=LONG)
    assert entered.wait(LONG)
    assert reader.read()
    assert reader.count == 3
    go_on.set()
    client.flush()
    assert seen == [3, 3, 3]
