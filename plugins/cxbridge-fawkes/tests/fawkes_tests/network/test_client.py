"""The client with a lost connection, or with a server that refuses or does not answer."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any
from uuid import UUID

import pytest
from msgspec.structs import replace

from cxbridge.blackboard import Listener, errors
from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.clock import RealClock, VirtualClock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus, InterfaceWrite, LogLine
from cxbridge.interfaces import default_registry
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.known_hashes import hash_for_wire
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.errors import ConnectionLostError, UnreachableError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder
from fawkes_tests.network.raw import TIMEOUT
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SAMPLE_SCHEMA, SampleInterface, SampleRegistry
from tests.blackboard.zmq.support import eventually


class NotificationQueue(Listener):
    """Returns notifications one after another, with a timeout."""

    def __init__(self) -> None:
        self._notifications: SimpleQueue[tuple[str, Any]] = SimpleQueue()

    def next(self) -> tuple[str, Any]:
        return self._notifications.get(timeout=TIMEOUT)

    def data_changed(self, interface: Any) -> None:
        interface.read()
        self._notifications.put(("changed", interface.count))

    def writer_added(self, interface: Interface, serial: object) -> None:
        self._notifications.put(("+writer", serial))

    def writer_removed(self, interface: Interface, serial: object) -> None:
        self._notifications.put(("-writer", serial))


def connection_changes(board: FawkesBlackBoard) -> Callable[[], bool]:
    changes: SimpleQueue[bool] = SimpleQueue()
    board.add_connection_callback(changes.put)
    return lambda: changes.get(timeout=TIMEOUT)


# -- the connection


def test_client_reopens_interfaces_after_restart_of_server(site):
    port = site.start().port
    board = site.client()
    changed = connection_changes(board)
    reader = board.open_for_reading(SampleInterface, "a")
    writer = board.open_for_writing(SampleInterface, "b")
    at_server = site.board.open_for_writing(SampleInterface, "a")
    at_server.count, writer.count = 1, 2
    at_server.write()
    writer.write()
    board.flush()
    reader.read()
    before = reader.serial
    notifications = NotificationQueue()
    board.register_listener(notifications, reader)

    site.server.stop()
    assert changed() is False
    assert notifications.next()[0] == "-writer"
    assert reader.read() is False
    assert (reader.valid, reader.count, reader.has_writer, board.connected) == (True, 1, False, False)
    for send in (writer.write, lambda: reader.msgq_enqueue(SampleInterface.ResetMessage())):
        with pytest.raises(ConnectionLostError, match=f"127.0.0.1:{port} is lost"):
            send()
    assert [info.id for info in site.board.list_all()] == ["a"]
    at_server.count = 3
    at_server.write()

    site.start(port)
    assert changed() is True
    assert board.connected
    assert notifications.next() == ("changed", 3)
    assert reader.serial != before
    assert (reader.has_writer, reader.num_readers) == (True, 1)
    reopened = site.board.open_for_reading(SampleInterface, "b")
    board.flush()
    reopened.read()
    assert reopened.count == 2
    assert reader.msgq_enqueue(SampleInterface.ResetMessage()) == 1
    board.flush()
    assert at_server.msgq_first().source_id == reader.serial


def test_writer_opened_during_disconnection_stays_writer(site):
    port = site.start().port
    board = site.client()
    changed = connection_changes(board)
    writer = board.open_for_writing(SampleInterface, "a")
    site.server.stop()
    rival = site.board.open_for_writing(SampleInterface, "a")
    assert changed() is False
    site.start(port)
    site.wait_warning("writer already exists")
    with pytest.raises(ConnectionLostError):
        writer.write()
    assert rival.valid
    rival.close()
    assert changed() is True
    eventually(lambda: board.connected)
    writer.count = 5
    writer.write()
    board.flush()
    assert site.board.list_all()[0].has_writer


def test_interface_that_cannot_reopen_becomes_invalid(site):
    port = site.start().port
    board = site.client()
    changed = connection_changes(board)
    reader = board.open_for_reading(SampleInterface, "a")
    unchanged = board.open_for_reading("OtherInterface", "a")
    site.server.stop()
    assert changed() is False
    newer = make_interface_class(replace(SAMPLE_SCHEMA, hash=bytes(16)))
    site.board.open_for_reading(newer, "a")
    site.start(port)
    assert changed() is True
    assert (reader.valid, unchanged.valid) == (False, True)
    with pytest.raises(errors.InvalidInstanceError):
        reader.read()


def test_client_shuts_down_without_server(site):
    site.start()
    board = site.client()
    changed = connection_changes(board)
    reader = board.open_for_reading(SampleInterface, "a")
    site.server.stop()
    assert changed() is False
    board.shutdown()
    board.shutdown()
    assert not reader.valid
    with pytest.raises(errors.BlackBoardGoneError):
        board.list_all()


def test_missing_server_is_unreachable():
    with socket.create_server(("127.0.0.1", 0)) as unused:
        port = unused.getsockname()[1]
    with pytest.raises(UnreachableError, match=f"no Fawkes answers at 127.0.0.1:{port}: "):
        FawkesBlackBoard(f"fawkes://127.0.0.1:{port}", SampleRegistry(), RealClock())


@pytest.mark.parametrize(
    "url", ["tcp://a", "fawkes://", "fawkes:///a", "fawkes://a:b", "fawkes://a/b", "fawkes://u@a"]
)
def test_invalid_urls_are_refused_with_hint(url):
    with pytest.raises(BlackBoardError, match="cannot use"):
        FawkesBlackBoard(url, SampleRegistry(), RealClock())


# -- the answers of the server


class ScriptedServer:
    """A server that answers each request with the test's answers."""

    def __init__(self, answer: Callable[[bb.BlackBoardMessage], list[bb.BlackBoardMessage | bytes]]) -> None:
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._sockets: list[socket.socket] = []
        self.requests: list[bb.BlackBoardMessage] = []
        self.url = f"fawkes://127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for sock in self._sockets:
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
        self._thread.join(TIMEOUT)

    def _run(self) -> None:
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:
                return
            self._sockets.append(sock)
            with sock:
                self._serve(sock)

    def _serve(self, sock: socket.socket) -> None:
        decoder = FrameDecoder(codec.client_payload_limit)
        with suppress(OSError):
            while data := sock.recv(65536):
                for frame in decoder.feed(data):
                    question = codec.decode(frame)
                    self.requests.append(question)
                    for answer in self._answer(question):
                        sock.sendall(answer if isinstance(answer, bytes) else answer.to_bytes())


@contextmanager
def connect_to_script(
    answer: Callable[[bb.BlackBoardMessage], list[bb.BlackBoardMessage | bytes]],
    registry: Any = None,
    timeout: float = TIMEOUT,
    bus: EventBus | None = None,
    **options: float,
) -> Iterator[tuple[ScriptedServer, FawkesBlackBoard]]:
    script = ScriptedServer(answer)
    try:
        registry = registry or SampleRegistry()
        with FawkesBlackBoard(script.url, registry, VirtualClock(), bus, timeout=timeout, **options) as board:
            yield script, board
    finally:
        script.close()


SERIAL = UUID(int=5)
BLOCK = bytes(SAMPLE_SCHEMA.datasize)


@pytest.mark.parametrize(
    ("failure", "error"),
    [
        (1, errors.UnknownTypeError),
        (3, errors.WriterActiveError),
        (0, RemoteRefusalError),
        (99, RemoteRefusalError),
    ],
)
def test_refusal_of_server_raises_error(failure, error):
    with connect_to_script(lambda question: [bb.OpenFailure(failure)]) as (_, board), pytest.raises(error):
        board.open_for_writing(SampleInterface, "a")


def test_block_of_different_size_is_refused_and_closed():
    def answer(question: bb.BlackBoardMessage) -> list[bb.BlackBoardMessage | bytes]:
        return [bb.OpenSuccess(SERIAL, False, 1, BLOCK + b"x")] if isinstance(question, bb.Open) else []

    with connect_to_script(answer) as (script, board):
        with pytest.raises(
            RemoteRefusalError,
            match=f"has {len(BLOCK) + 1} bytes at the other end, but {len(BLOCK)} bytes here",
        ):
            board.open_for_reading(SampleInterface, "a")
        board.shutdown()
        assert script.requests[1:] == [bb.Close(SERIAL)]


def test_server_without_answer_loses_connection():
    answers: Iterator[list[bb.BlackBoardMessage | bytes]] = iter([[]])
    with connect_to_script(lambda question: next(answers, [bb.InterfaceList(())]), timeout=0.2) as (_, board):
        changed = connection_changes(board)
        with pytest.raises(ConnectionLostError, match=r"no reply within 0\.2 s"):
            board.list_all()
        assert changed() is False
        assert changed() is True
        assert board.connected


def test_busy_server_stays_connected():
    """A busy server answers late, but sends data meanwhile."""
    connections: list[Any] = []
    data_frame = bb.DataMessage(UUID(int=9), BLOCK, changed=True).to_bytes()

    def answer(question: bb.BlackBoardMessage) -> list[bb.BlackBoardMessage | bytes]:
        for _ in range(12):  # longer than the timeout of an answer
            script._sockets[-1].sendall(data_frame)
            threading.Event().wait(0.1)
        connections.append(board._requests.connection)
        return [bb.InterfaceList(())]

    with connect_to_script(lambda question: [], timeout=1.0, silence=0) as (script, board):
        script._answer = answer
        before = board._requests.connection
        board.probe()
        assert connections == [before]
        assert board._requests.connection is before


def test_shutdown_waits_until_server_has_processed_writes():
    """Fawkes drops the unprocessed requests of a disconnected client."""

    def answer(question: bb.BlackBoardMessage) -> list[bb.BlackBoardMessage | bytes]:
        if isinstance(question, bb.Open):
            return [bb.OpenSuccess(SERIAL, False, 1, BLOCK)]
        if not isinstance(question, bb.ListAll | bb.ListMatching):
            return []
        processed.extend(script.requests)
        return [bb.InterfaceList(())]

    processed: list[bb.BlackBoardMessage] = []
    with connect_to_script(answer) as (script, board):
        board.open_for_writing(SampleInterface, "a").write()
        board.shutdown()
        assert any(isinstance(frame, bb.DataMessage) for frame in processed), (
            "the client disconnected without a round trip"
        )


def test_invalid_frames_of_server_are_ignored_and_logged_once():
    noise: list[bb.BlackBoardMessage | bytes] = [
        FawkesFrame(77, 1, b"x").to_bytes(),
        FawkesFrame(2, 9, b"x").to_bytes(),
        FawkesFrame(2, 77).to_bytes(),
        bb.DataMessage(SERIAL, b"x", changed=True),
        bb.DataMessage(UUID(int=6), BLOCK, changed=True),
        bb.WireMessage(SERIAL, SERIAL, "ResetMessage", 1, 0, b""),
        bb.OpenFailure(1),
        bb.ListAll(),
    ]

    def answer(question: bb.BlackBoardMessage) -> list[bb.BlackBoardMessage | bytes]:
        if isinstance(question, bb.Open):
            return [bb.OpenSuccess(SERIAL, False, 1, BLOCK), *noise * 5]
        return [bb.InterfaceList(())]

    bus = EventBus(VirtualClock())
    lines: list[Any] = []
    bus.subscribe(lines.append, LogLine)
    with connect_to_script(answer, bus=bus) as (_, board):
        reader = board.open_for_reading(SampleInterface, "a")
        board.flush()
        assert reader.read() is False
        assert board.connected
        texts = [line.text for line in lines]
        assert len(texts) == len(set(texts)) == 6


def test_oversized_frame_of_server_ends_connection():
    with (
        connect_to_script(lambda question: [b"\0\x02\0\x01\xff\xff\xff\xff"]) as (_, board),
        pytest.raises(ConnectionLostError, match="announces 4294967295 bytes"),
    ):
        board.list_all()


# -- hashes

NetTest: Any = default_registry().get("TestInterface")
OTHER_HASH = bytes(range(16))


class FawkesWithHash:
    """Answers like a Fawkes whose TestInterface has the hash ``real``."""

    def __init__(self, real: bytes, *, listed: bool = True) -> None:
        self._real = real
        self._listed = listed

    def __call__(self, question: bb.BlackBoardMessage) -> list[bb.BlackBoardMessage | bytes]:
        if isinstance(question, bb.Open):
            if question.hash == self._real:
                return [bb.OpenSuccess(SERIAL, False, 1, bytes(NetTest.SCHEMA.datasize))]
            return [bb.OpenFailure(bb.OpenError.HASH_MISMATCH)]
        info = bb.ListedInterface("TestInterface", "x", self._real, 1, True, 0, 0)
        return [bb.InterfaceList((info,) if self._listed else ())]


def test_client_offers_hash_of_fawkes_first():
    real = hash_for_wire(NetTest.SCHEMA)
    assert real != NetTest.SCHEMA.hash
    with connect_to_script(FawkesWithHash(real), default_registry()) as (script, board):
        assert board.open_for_reading(NetTest, "a").hash == NetTest.SCHEMA.hash
        assert [info.hash for info in board.list_all()] == [NetTest.SCHEMA.hash]
        assert script.requests[0] == bb.Open("TestInterface", "a", real, writing=False)


def test_client_offers_own_hash_if_listed_by_server():
    own = NetTest.SCHEMA.hash
    with connect_to_script(FawkesWithHash(own), default_registry()) as (script, board):
        for _ in range(2):
            assert board.open_for_reading(NetTest, "a").valid
            del board._ports_by_serial[SERIAL.bytes]
        offers = [question.hash for question in script.requests if isinstance(question, bb.Open)]
        assert offers == [hash_for_wire(NetTest.SCHEMA), own] * 2


@pytest.mark.parametrize("listed", [True, False])
def test_different_definition_is_refused_with_both_hashes(listed):
    with connect_to_script(FawkesWithHash(OTHER_HASH, listed=listed), default_registry()) as (script, board):
        with pytest.raises(errors.VersionMismatchError) as caught:
            board.open_for_writing(NetTest, "a")
        assert hash_for_wire(NetTest.SCHEMA).hex().upper() in str(caught.value)
        assert (OTHER_HASH.hex().upper() in str(caught.value)) is listed
        assert sum(isinstance(question, bb.Open) for question in script.requests) == 1


# -- the bus


def test_bus_gets_each_write_once(served):
    board = served.client()
    events: list[Any] = []
    assert board.bus is not None
    board.bus.subscribe(events.append, InterfaceWrite)
    readers = [board.open_for_reading(SampleInterface, "a") for _ in range(2)]
    writer = served.board.open_for_writing(SampleInterface, "a")
    writer.count = 1
    writer.write()
    board.flush()
    assert [(event.uid, event.values["count"]) for event in events] == [("SampleInterface::a", 1)]
    writer.close()
    board.flush()
    own = board.open_for_writing(SampleInterface, "a")
    own.count = 2
    own.write()
    board.flush()
    assert [event.values["count"] for event in events] == [1, 2]
    assert readers[0].read()


# -- order


def test_instance_removal_precedes_interface_removal(served, monkeypatch):
    """A server that is quicker than the closing thread must not bring "destroyed" before "-reader"."""
    board, recorder = served.client(), Recorder()
    board.register_observer(recorder)
    reader = board.open_for_reading(SampleInterface, "a")
    board.register_listener(recorder, reader)
    board.flush()
    send = board._requests.send

    def send_and_wait(frames: bytes) -> None:
        send(frames)
        board.flush()  # the answer to Close and its events are delivered

    monkeypatch.setattr(board._requests, "send", send_and_wait)
    reader.close()
    monkeypatch.undo()
    board.flush()
    uid = "SampleInterface::a"
    assert recorder.log == [("created", uid), ("-reader", uid, reader.serial), ("destroyed", uid)]
