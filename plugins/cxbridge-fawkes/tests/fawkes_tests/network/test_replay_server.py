"""The server answers the recorded requests of Fawkes' clients as Fawkes answers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import pytest

from cxbridge.blackboard import Listener, LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import default_registry
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge_fawkes.network.components.logger import NetworkLogger
from cxbridge_fawkes.network.components.plugins import PluginManager
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.server import HANDLER_COMPONENT, FawkesServer
from fawkes_tests.network.raw import RawClient
from fawkes_tests.network.recordings import SerialMap, Step, load
from tests.support import needs_shared

pytestmark = needs_shared

STATUS_FINAL, STATUS_RUNNING = 1, 2
LOG_HEAD_SIZE = 16
"""The size of level, seconds and microseconds before the texts of a log line."""
CREATED, DESTROYED = bb.BoardKind.INTERFACE_CREATED, bb.BoardKind.INTERFACE_DESTROYED


class Process:
    """A board and the server under test."""

    def __init__(self) -> None:
        clock = RealClock()
        self.bus = EventBus(clock)
        self.board = LocalBlackBoard(default_registry(), clock, self.bus)
        plugins = PluginManager(lambda: [("flite", "speech", True), ("skiller", "skills", True)])
        components = [NetworkLogger(self.bus), plugins]
        self.server = FawkesServer(self.board, port=0, components=components)

    def populate(self, infos: Iterable[bb.ListedInterface]) -> None:
        """Open the interfaces of a recorded list, with the recorded time stamps and order."""
        for info in infos:
            instances = [self.board.open_for_reading(info.type, info.id) for _ in range(info.num_readers)]
            if info.has_writer:
                instances.append(self.board.open_for_writing(info.type, info.id))
                _write(instances[-1], timestamp_us=info.timestamp_us)


def _write(writer: Interface, block: bytes | None = None, timestamp_us: int = 0) -> None:
    values: Any = type(writer)
    chunk = bytearray(block or bytes(values.SCHEMA.datasize))
    if block is None:
        chunk[:16] = STAMP.pack(*divmod(timestamp_us, 1_000_000))
    writer.set_from_chunk(chunk)
    writer.write()


class FakeSkiller(Listener):
    """Handles and logs messages as the recorded Skiller does."""

    def __init__(self, process: Process, block: bytes, *, finishes: bool) -> None:
        self._skiller: Any = process.board.open_for_writing("SkillerInterface", "Skiller")
        _write(self._skiller, block)
        self._skiller.read()
        self._log = process.bus.logger("SkillerLua")
        self._finishes = finishes
        process.board.register_listener(self, self._skiller)

    def message_received(self, interface: Interface, message: Message) -> bool:
        act: Callable[[Any], None] = {
            "AcquireControlMessage": self._acquire,
            "ExecSkillMessage": self._exec,
            "ReleaseControlMessage": self._release,
        }[message.type]
        act(message)
        return False

    def _acquire(self, message: Any) -> None:
        self._skiller.exclusive_controller = str(message.source_id)
        self._skiller.write()
        self._log.debug(f"{HANDLER_COMPONENT} (serial {message.source_id}) is new exclusive controller")

    def _exec(self, message: Any) -> None:
        self._log.info(f"{HANDLER_COMPONENT} executes '{message.skill_string}'")
        self._skiller.skill_string, self._skiller.msgid = message.skill_string, message.id
        self._skiller.status = STATUS_RUNNING
        self._skiller.write()
        if self._finishes:
            self._skiller.error, self._skiller.status = "", STATUS_FINAL
            self._skiller.write()

    def _release(self, message: Any) -> None:
        self._log.debug(f"{HANDLER_COMPONENT} releases exclusive control")
        self._skiller.exclusive_controller = ""
        self._skiller.write()


@pytest.fixture
def process() -> Iterator[Process]:
    process = Process()
    with process.server:
        yield process


class Replay:
    """Sends the recorded requests and compares the answers."""

    def __init__(self, process: Process, same: Callable[[FawkesFrame, FawkesFrame], bool]) -> None:
        self._port = process.server.port
        self._clients: dict[int, RawClient] = {}
        self._serials = SerialMap()
        self._same = same
        self.compared = 0

    def run(self, steps: Iterable[Step]) -> None:
        try:
            for step in steps:
                getattr(self, f"_{step.action}")(step)
        finally:
            for client in self._clients.values():
                client.close()

    def _connect(self, step: Step) -> None:
        self._clients[step.conn] = RawClient(self._port)

    def _disconnect(self, step: Step) -> None:
        self._clients[step.conn].close()

    def _request(self, step: Step) -> None:
        self._clients[step.conn].send(self._serials.translate(step.frame))

    def _answer(self, step: Step) -> None:
        received = self._clients[step.conn].take()
        assert received[:2] == step.frame[:2]
        if received[:2] == (ComponentId.BLACKBOARD, bb.BoardKind.OPEN_SUCCESS):
            actual = codec.decode(received)
            assert isinstance(actual, bb.OpenSuccess)
            self._serials.learn(step.message.serial, actual.serial)
        expected = self._serials.translate(step.frame)
        assert received == expected or self._same(received, expected), (received, expected)
        self.compared += 1


def equal_without_time(received: FawkesFrame, expected: FawkesFrame) -> bool:
    """Return whether two data frames differ at most in their time stamps."""
    if received.component == ComponentId.BLACKBOARD and received.kind in (
        bb.BoardKind.DATA_REFRESHED,
        bb.BoardKind.DATA_CHANGED,
    ):
        start = bb.DATA_HEAD.size
        return received.payload[:start] + received.payload[start + 16 :] == (
            expected.payload[:start] + expected.payload[start + 16 :]
        )
    return False


@pytest.mark.parametrize("name", ["skillet-say", "skillet-say-wait"])
def test_server_answers_skillet(process, name):
    steps = load(name)
    opened = next(step.message for step in steps if step.action == "answer")
    FakeSkiller(process, opened.block, finishes=name == "skillet-say")
    process.board.open_for_reading("SkillerInterface", "Skiller")
    replay = Replay(process, equal_without_time)
    replay.run(steps)
    assert replay.compared == {"skillet-say": 9, "skillet-say-wait": 7}[name]


def test_server_answers_ffplugin_list(process):
    replay = Replay(process, lambda received, expected: False)
    replay.run(load("ffplugin-list"))
    assert replay.compared == 1


# -- the log


def equal_without_names(received: FawkesFrame, expected: FawkesFrame) -> bool:
    if received.component != ComponentId.NETWORK_LOGGER:
        return equal_without_time(received, expected)
    return _anonymous(received) == _anonymous(expected)


def _anonymous(line: FawkesFrame) -> tuple[bytes, bytes]:
    """Return the level and the texts of a log line, without time and serials."""
    level, texts = line.payload[:4], line.payload[LOG_HEAD_SIZE:]
    texts = re.sub(rb"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", b"<serial>", texts)
    return level, re.sub(rb"Remote \d+ ", b"Remote <number> ", texts)


def without_lateness(steps: list[Step]) -> list[Step]:
    """Leave out log lines about a late main loop."""
    return [
        step
        for step in steps
        if step.action != "answer"
        or step.frame.component != ComponentId.NETWORK_LOGGER
        or step.frame.payload[LOG_HEAD_SIZE:].partition(b"\0")[0] != b"FawkesMainThread"
    ]


def by_connection(steps: list[Step]) -> list[Step]:
    """Move the log to the end: log and answers use two connections without a common order."""
    log = [step for step in steps if step.action == "answer" and step.conn == 0]
    ends = [step for step in steps if step.action == "disconnect"]
    return [step for step in steps if step not in log and step not in ends] + log + ends


def test_server_answers_fflogview(process):
    steps = without_lateness(load("fflogview"))
    opened = next(step.message for step in steps if step.conn == 1 and step.action == "answer")
    FakeSkiller(process, opened.block, finishes=True)
    process.board.open_for_reading("SkillerInterface", "Skiller")
    replay = Replay(process, equal_without_names)
    steps = by_connection(steps)
    replay.run(steps)
    log = [step.frame for step in steps if step.action == "answer" and step.conn == 0]
    assert [line.payload[0] for line in log].count(1) == 1  # the level INFO
    assert replay.compared == len(log) + 9


# -- the blackboard


def without_kept_interfaces(steps: list[Step]) -> list[Step]:
    """Leave out or correct the steps with HashMis and HashMisW.

    Fawkes creates an interface before the comparison of hashes: it kept both, and later refused to open
    HashMisW. This server creates HashMisW only for the right hash, and removes HashMisW with its client.
    """
    corrected: list[Step] = []
    for step in steps:
        message = step.message if step.action == "answer" else None
        if isinstance(message, bb.InterfaceEvent) and message.id.startswith("HashMis"):
            continue
        if isinstance(message, bb.InterfaceList):
            kept = tuple(info for info in message.interfaces if not info.id.startswith("HashMis"))
            step = replace(step, frame=bb.InterfaceList(kept).to_frame())  # noqa: PLW2901
        corrected.append(step)
    refused = next(
        index
        for index, step in enumerate(corrected)
        if step.conn == 2
        and step.action == "answer"
        and step.message == bb.OpenFailure(bb.OpenError.WRITER_EXISTS)
    )
    created = bb.InterfaceEvent(CREATED, "TestInterface", "HashMisW").to_frame()
    corrected[refused : refused + 1] = [Step(conn, "answer", created) for conn in (0, 1, 2)] + [
        Step(2, "opened")
    ]
    disconnected = corrected.index(Step(2, "disconnect"))
    destroyed = bb.InterfaceEvent(DESTROYED, "TestInterface", "HashMisW").to_frame()
    corrected[disconnected + 1 : disconnected + 1] = [Step(conn, "answer", destroyed) for conn in (0, 1)]
    return corrected


class BbnetReplay(Replay):
    def _opened(self, step: Step) -> None:
        message = self._clients[step.conn].message()
        assert isinstance(message, bb.OpenSuccess)
        assert (message.has_writer, message.num_readers) == (True, 0)


def test_server_answers_bbnet(process):
    """The answers are equal byte for byte, with times, because the clients write the data."""
    steps = without_kept_interfaces(load("bbnet"))
    lists = [
        step.message
        for step in steps
        if step.action == "answer" and step.frame.kind == bb.BoardKind.INTERFACE_LIST
    ]
    process.populate(lists[0].interfaces)
    opened = next(
        step.message
        for step in steps
        if step.action == "answer" and step.frame.kind == bb.BoardKind.OPEN_SUCCESS
    )
    infos = {info.uid: info for info in process.board.list_all()}
    assert infos["SkillerInterface::Skiller"].num_readers == 1
    rewrite_skiller(process, opened.block)
    replay = BbnetReplay(process, lambda received, expected: False)
    replay.run(steps)
    assert replay.compared == sum(step.action == "answer" for step in steps)


def rewrite_skiller(process: Process, block: bytes) -> None:
    """Give the Skiller's interface the recorded content."""
    (memory,) = (m for m in process.board._memories.values() if m.uid == "SkillerInterface::Skiller")
    writer = memory.instances()[-1]
    assert writer.is_writer
    _write(writer, block)
