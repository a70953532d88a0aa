"""The client sends the recorded requests to a server that replays the answers of Fawkes."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterable
from contextlib import ExitStack
from functools import partial
from queue import SimpleQueue
from typing import Any, Self

import pytest

from cxbridge.blackboard import Listener, errors
from cxbridge.clock import VirtualClock
from cxbridge.interfaces import SkillerInterface, default_registry
from cxbridge.interfaces.instance import Interface, Message
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.codec import client_payload_limit
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder
from fawkes_tests.network.recordings import Step, load
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.zmq.support import eventually
from tests.support import needs_shared

pytestmark = needs_shared

TIMEOUT = 20.0
NetTest: Any = default_registry().get("TestInterface")  # a name that pytest does not collect


class RecordedServer:
    """Sends each recorded answer after the recorded requests before it; keeps the received requests."""

    def __init__(self, steps: Iterable[Step]) -> None:
        self._steps = list(steps)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(TIMEOUT)
        self._sockets: dict[int, socket.socket] = {}
        self._decoders: dict[int, FrameDecoder] = {}
        self._frames: dict[int, list[FawkesFrame]] = {}
        self.url = f"fawkes://127.0.0.1:{self._listener.getsockname()[1]}"
        self.requests: list[FawkesFrame] = []
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is not None:
            self._listener.close()
            for sock in self._sockets.values():
                sock.close()
        self._thread.join(TIMEOUT)
        self._listener.close()
        for sock in self._sockets.values():
            sock.close()
        if kind is None:
            assert self.failure is None, self.failure
            assert self.requests == [step.frame for step in self._steps if step.action == "request"]

    def _run(self) -> None:
        try:
            for step in self._steps:
                getattr(self, f"_{step.action}")(step)
        except BaseException as failure:  # noqa: BLE001 - the test's thread raises the error
            self.failure = failure

    def _connect(self, step: Step) -> None:
        sock, _ = self._listener.accept()
        sock.settimeout(TIMEOUT)
        self._sockets[step.conn] = sock
        self._decoders[step.conn] = FrameDecoder(client_payload_limit)
        self._frames[step.conn] = []

    def _request(self, step: Step) -> None:
        frames = self._frames[step.conn]
        while not frames:
            data = self._sockets[step.conn].recv(65536)
            assert data, f"the client closed the connection, the recording has {step.message}"
            frames.extend(self._decoders[step.conn].feed(data))
        self.requests.append(frames.pop(0))

    def _answer(self, step: Step) -> None:
        self._sockets[step.conn].sendall(step.frame.to_bytes())

    def _disconnect(self, step: Step) -> None:
        sock, frames = self._sockets[step.conn], self._frames[step.conn]
        if not frames and (data := sock.recv(65536)):
            frames.extend(self._decoders[step.conn].feed(data))
        if frames:
            # only this client checks that the server has taken the last frame
            assert frames == [bb.ListMatching("", "").to_frame()]
            sock.sendall(bb.InterfaceList(()).to_bytes())
            assert sock.recv(1) == b""
        sock.close()


class WaitingRecorder(Recorder):
    """Records all events, and waits for expected events."""

    def wait(self, *events: tuple[object, ...]) -> None:
        eventually(lambda: self.log[: len(events)] == list(events))
        del self.log[: len(events)]


class MessageQueue(Listener):
    """Returns the messages to a writer one after another, with a timeout."""

    def __init__(self) -> None:
        self._messages: SimpleQueue[Any] = SimpleQueue()
        self.next = partial(self._messages.get, timeout=TIMEOUT)

    def message_received(self, interface: Interface, message: Message) -> bool:
        self._messages.put(message)
        return False


@pytest.mark.parametrize("name", ["skillet-say", "skillet-say-wait"])
def test_client_sends_requests_of_skillet(name):
    steps = load(name)
    skill = next(
        s.message for s in steps if s.action == "request" and s.frame.payload[32:48] == b"ExecSkillMessage"
    )
    with (
        RecordedServer(steps) as server,
        FawkesBlackBoard(server.url, default_registry(), VirtualClock(), timeout=TIMEOUT, silence=0) as board,
    ):
        skiller = board.open_for_reading(SkillerInterface, "Skiller")
        recorder = WaitingRecorder()
        board.register_listener(recorder, skiller)
        assert (skiller.has_writer, skiller.num_readers) == (True, 2)
        message = SkillerInterface.ExecSkillMessage()
        message.set_from_chunk(skill.block)
        ids = [
            skiller.msgq_enqueue(each)
            for each in (
                SkillerInterface.AcquireControlMessage(),
                message,
                SkillerInterface.ReleaseControlMessage(),
            )
        ]
        assert ids == [1, 2, 3]
        writes = sum(
            step.action == "answer" and step.frame.kind == bb.BoardKind.DATA_CHANGED for step in steps
        )
        recorder.wait(*[("refreshed", skiller.uid), ("changed", skiller.uid)] * writes)
        assert skiller.read()
        assert skiller.skill_string == message.skill_string
        assert (skiller.msgid, skiller.exclusive_controller) == (2, "")
        skiller.close()


def without_third_client(steps: list[Step]) -> list[Step]:
    """Leave out the third client, which sends invalid frames, and the message without a writer."""
    last = max(
        i
        for i, s in enumerate(steps)
        if s.action == "request" and s.frame.kind == bb.BoardKind.INTERFACE_MESSAGE
    )
    return [step for index, step in enumerate(steps) if step.conn < 2 and index != last]


def test_client_sends_requests_of_bbnet():  # noqa: PLR0915 - one conversation
    clock = VirtualClock()
    recorder = WaitingRecorder()
    uid = "TestInterface::NetTest"

    def write(writer: Any, stamp_us: int) -> None:
        clock.sleep_until(stamp_us)
        writer.write()

    with ExitStack() as stack:
        server = stack.enter_context(RecordedServer(without_third_client(load("bbnet"))))

        def connect() -> FawkesBlackBoard:
            return stack.enter_context(
                FawkesBlackBoard(server.url, default_registry(), clock, timeout=TIMEOUT, silence=0)
            )

        a = connect()
        a.register_observer(recorder)
        assert [info.uid for info in a.list_all()] == [
            "SpeechSynthInterface::Flite",
            "SkillerInterface::Skiller",
            "SkillerDebugInterface::Skiller",
            "SkillerDebugInterface::SkillerLayouted",
        ]
        assert [info.serial for info in a.list("Sk*")] == [2, 3, 4]
        skiller = a.open_for_reading(SkillerInterface, "Skiller")
        reader = a.open_for_reading(NetTest, "NetTest")
        recorder.wait(("created", uid))
        a.register_listener(recorder, reader)
        assert (reader.has_writer, reader.num_readers) == (False, 1)

        b = connect()
        writer = b.open_for_writing(NetTest, "NetTest")
        recorder.wait(("+writer", uid, writer.serial))
        writer.test_int, writer.test_string = 42, "hello"
        write(writer, 1795226080393970)
        recorder.wait(("refreshed", uid), ("changed", uid))
        reader.read()
        assert (reader.test_int, reader.test_string) == (42, "hello")
        writer.write()
        recorder.wait(("refreshed", uid))
        writer.test_int = 42
        write(writer, 1795226080794430)
        recorder.wait(("refreshed", uid))
        at_writer = MessageQueue()
        b.register_listener(at_writer, writer)
        assert reader.msgq_enqueue(NetTest.SetTestIntMessage(7)) == 1
        message = at_writer.next()
        assert (message.id, message.hops, message.test_int) == (1, 1, 7)
        assert message.source_id == reader.serial
        writer.test_int = message.test_int
        write(writer, 1795226081295017)
        recorder.wait(("refreshed", uid), ("changed", uid))
        reader.read()
        assert reader.test_int == 7

        with pytest.raises(errors.WriterActiveError):
            a.open_for_writing(NetTest, "NetTest")
        recorder.wait(("created", "TestInterface::HashMis"), ("created", "TestInterface::HashMisW"))
        assert len(a.list_all()) == 7
        writer.close()
        recorder.wait(("-writer", uid, writer.serial))
        with pytest.raises(errors.NoWriterError):
            reader.msgq_enqueue(NetTest.SetTestIntMessage(9))
        reader.close()
        skiller.close()
        recorder.wait(("-reader", uid, reader.serial), ("destroyed", uid))
        b.shutdown()
        a.shutdown()
