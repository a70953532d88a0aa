"""Sessions that end and begin again, slow readers, and local instances of the server's process."""

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
def served(tmp_path):
    with bench("ipc", tmp_path) as served:
        yield served


def freeze(client) -> None:
    """Make a client silent, as a stopped process."""
    client._session._keep_alive = lambda now, gap: None


# -- local instances


def test_flush_waits_for_earlier_writes_of_server_process(served):
    writer = served.board.open_for_writing(SampleInterface, "a")
    client = served.client()
    reader = client.open_for_reading(SampleInterface, "a")
    original_run = served.server.run_posted_calls
    requests = served.server._requests
    requests._loop = SimpleNamespace(
        is_current_thread=served.server.is_current_thread,
        post=served.server.post,
        run_posted_calls=original_run,
    )
    served.server.run_posted_calls = lambda: None  # as if further frames always waited
    try:
        writer.count = 7
        writer.write()
        client.flush()
        assert reader.read()
        assert reader.count == 7
    finally:
        served.server.run_posted_calls, requests._loop = original_run, served.server


def test_messages_between_local_and_remote_instances(served):
    client = served.client()
    for near, far in ((served.board, client), (client, served.board)):
        interface_id = type(near).__name__
        reader = near.open_for_reading(SampleInterface, interface_id)
        writer = far.open_for_writing(SampleInterface, interface_id, queue_limit=2)
        served.settle()
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


def test_frame_that_cannot_be_encoded_uses_no_number(served):
    client = served.client()
    (session,) = served.server._sessions.values()
    with pytest.raises(ProtocolError):
        session.send(Existence(True, "\udc80", ""))
    client.flush()
    assert served.server._sessions == {session.id: session}


def test_remote_listener_declines_local_message(served):
    client = served.client()
    reader = served.board.open_for_reading(SampleInterface, "a")
    writer = client.open_for_writing(SampleInterface, "a")

    class SaysNo(Listener):
        def message_received(self, interface, message):
            return False

    client.register_listener(SaysNo(), writer)
    message = Reset()
    reader.msgq_enqueue(message)
    assert not message.enqueued
    assert writer.msgq_empty()


def test_instances_of_silent_client_are_closed_within_three_heartbeats(tmp_path):
    with bench("tcp", tmp_path, heartbeat=0.2) as served:
        witness = served.client()
        reader = witness.open_for_reading(SampleInterface, "a")
        victim = served.client()
        writer = victim.open_for_writing(SampleInterface, "a", owner="victim")
        victim.open_for_reading(SampleInterface, "a")
        served.settle()
        log = Recorder()
        witness.register_listener(log, reader, EventKind.WRITER_REMOVED, EventKind.READER_REMOVED)
        freeze(victim)
        served.clients.remove(victim)
        eventually(lambda: len(log.log) == 2)
        victim.shutdown()
        assert {entry[0] for entry in log.log} == {"-writer", "-reader"}
        assert not reader.has_writer
        assert not writer.valid
        assert witness.open_for_writing(SampleInterface, "a").is_writer


def test_message_to_silent_writer_is_error_within_timeout(tmp_path):
    with bench("tcp", tmp_path, heartbeat=0.2) as served:
        reader = served.client().open_for_reading(SampleInterface, "a")
        victim = served.client()
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


# -- loss of the server


def restart(served, **options) -> None:
    """Stop the server and serve a new, empty blackboard at the same endpoint."""
    served.server.stop()
    served.board.shutdown()
    served.board = type(served.board)(served.board.registry, served.clock, served.bus)
    served.server = ZmqBlackBoardServer(served.board, served.server.endpoints, **options)
    served.server.start()


@pytest.fixture(params=["ipc", "tcp"])
def restartable(request, tmp_path):
    with bench(request.param, tmp_path) as served:
        yield served
        served.shut_down_clients()
        served.server.stop()


def test_clients_continue_after_restart_of_server(restartable):
    served = restartable
    near, far = served.client(), served.client()
    reader = near.open_for_reading(SampleInterface, "a", owner="r")
    writer = far.open_for_writing(SampleInterface, "a", owner="w")
    writer.count = 7
    writer.write()
    served.settle()
    assert reader.read()
    restart(served)
    started = time.monotonic()
    eventually(lambda: near.connected and far.connected and reader.has_writer)
    assert time.monotonic() - started < 2
    assert (reader.valid, writer.valid, reader.count, reader.readers) == (True, True, 7, ("r",))
    late = near.open_for_reading(SampleInterface, "a")
    eventually(late.read)
    assert late.count == 7
    writer.count = 8
    writer.write()
    served.settle()
    assert reader.read()
    assert reader.count == 8
    assert reader.msgq_enqueue(Reset()) == 1
    assert writer.msgq_size() == 1


def test_last_write_without_server_is_published_after_restart(served):
    near, far = served.client(), served.client()
    reader = near.open_for_reading(SampleInterface, "a")
    writer = far.open_for_writing(SampleInterface, "a")
    endpoints = served.server.endpoints
    served.server.stop()
    eventually(lambda: not near.connected and not far.connected)
    assert not reader.has_writer
    for count in (1, 2, 3):
        writer.count = count
        writer.write()
    with pytest.raises(DisconnectedError, match="no connection"):
        near._sender.request(Sync(), timeout_s=0.05)
    served.server = ZmqBlackBoardServer(served.board, endpoints)
    with served.server:
        eventually(reader.read)
        assert reader.count == 3
        served.shut_down_clients()


def test_write_lost_with_session_is_sent_again(served):
    reader = served.client().open_for_reading(SampleInterface, "a")
    writer = served.client().open_for_writing(SampleInterface, "a")
    requests = served.server._requests

    def lose_write(session, _frame):
        del requests._handle_write  # the next write is handled
        served.server._mark_failed(session, ResultCode.FRAME_LOST)

    requests._handle_write = lose_write
    writer.count = 2
    writer.write()
    eventually(reader.read)
    assert reader.count == 2


def test_listeners_and_observers_get_loss_and_return_of_server(served):
    near, far = served.client(), served.client()
    reader = near.open_for_reading(SampleInterface, "a")
    far.open_for_writing(SampleInterface, "a")
    far.open_for_reading(SampleInterface, "b")
    served.settle()
    log = Recorder()
    near.register_listener(log, reader, EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED)
    near.register_observer(log)
    served.server.stop()
    eventually(lambda: log.log)
    assert log.take()[0][:2] == ("-writer", "SampleInterface::a")
    far.shutdown()
    with ZmqBlackBoardServer(served.board, served.server.endpoints):
        eventually(lambda: log.log)
        near.flush()
        assert log.take() == [("destroyed", "SampleInterface::b")]
        served.shut_down_clients()


def test_writer_that_reconnects_late_becomes_invalid(served):
    first = served.client()
    writer = first.open_for_writing(SampleInterface, "a", owner="first")
    lines = served.collect_lines()
    served.server.stop()
    served.board.open_for_writing(SampleInterface, "a", owner="second")
    with ZmqBlackBoardServer(served.board, served.server.endpoints):
        eventually(lambda: not writer.valid)
        with pytest.raises(errors.InvalidInstanceError):
            writer.write()
        eventually(lambda: first.connected)
        assert first.list_all()[0].writer == "second"
        assert any("could not be opened again: WRITER_ACTIVE" in line.text for line in lines)
        served.shut_down_clients()


def test_client_without_server_is_disconnected_error(tmp_path):
    from cxbridge.blackboard.zmq import ZmqBlackBoard
    from cxbridge.clock import VirtualClock
    from tests.blackboard.samples import SampleRegistry

    for url in (f"ipc://{tmp_path}/none", "tcp://127.0.0.1:1"):
        with pytest.raises(DisconnectedError, match="no blackboard replies at") as caught:
            ZmqBlackBoard(url, SampleRegistry(), VirtualClock(), connect_timeout=0.1)
        assert "'cxbridge daemon' starts a daemon" in str(caught.value)


def test_server_refuses_ipc_endpoint_in_use(served):
    """libzmq alone would unlink the socket of the other server and bind."""
    server = ZmqBlackBoardServer(served.board, served.server.endpoints)
    with pytest.raises(EndpointError, match="another process serves ipc://"):
        server.start()
    assert served.client().connected


# -- slow readers


def test_stopped_reader_gets_newest_value(tmp_path):
    with bench("ipc", tmp_path, window=8) as served:
        slow, quick = served.client(), served.client()
        slow_reader = slow.open_for_reading(SampleInterface, "a")
        quick_reader = quick.open_for_reading(SampleInterface, "a")
        writer = served.client().open_for_writing(SampleInterface, "a")
        resume = threading.Event()
        original_handler = slow._dispatcher._handle_frame_bytes

        def take(data: bytes) -> None:
            resume.wait(LONG)
            original_handler(data)

        cast("Any", slow._dispatcher)._handle_frame_bytes = take
        for count in range(1, 501):
            writer.count = count
            writer.write()
        served.clients[2].flush()
        quick.flush()
        assert quick_reader.read()
        assert quick_reader.count == 500
        (session,) = (s for s in served.server._sessions.values() if s.credit == 0)
        assert len(session.waiting_channels) == 1
        resume.set()
        eventually(lambda: slow_reader.read() and slow_reader.count == 500)
        assert slow.skipped >= 400


def test_updates_replaced_by_open_count_as_skipped(tmp_path):
    with bench("ipc", tmp_path, window=8) as served:
        slow = served.client()
        reader = slow.open_for_reading(SampleInterface, "a")
        writer = served.board.open_for_writing(SampleInterface, "a")
        cast("Any", slow._dispatcher)._give_credit = lambda: None
        for count in range(1, 51):
            writer.count = count
            writer.write()
        slow.flush()
        slow.open_for_reading(SampleInterface, "a")
        assert reader.read()
        assert reader.count == 50
        assert slow.skipped == 41


def test_listener_does_not_read_older_data_than_instance(served):
    client = served.client()
    reader = client.open_for_reading(SampleInterface, "a")
    writer = served.client().open_for_writing(SampleInterface, "a")
    entered, resume, seen = threading.Event(), threading.Event(), []

    class Slow(Listener):
        def data_changed(self, interface):
            entered.set()
            resume.wait(LONG)
            interface.read()
            seen.append(interface.count)

    client.register_listener(Slow(), reader)
    for count in (1, 2, 3):
        writer.count = count
        writer.write()
    served.clients[1].flush()
    client._sender.request(Sync(), timeout_s=LONG)
    assert entered.wait(LONG)
    assert reader.read()
    assert reader.count == 3
    resume.set()
    client.flush()
    assert seen == [3, 3, 3]
