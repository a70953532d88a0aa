"""What real Fawkes clients sent, sent to our server: it answers as the real Fawkes did."""

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
"""The bytes of a log line before its texts: level, seconds, microseconds."""
CREATED, DESTROYED = bb.BoardKind.INTERFACE_CREATED, bb.BoardKind.INTERFACE_DESTROYED


class Process:
    """A process with a board, and the server to be tested."""

    def __init__(self) -> None:
        clock = RealClock()
        self.bus = EventBus(clock)
        self.board = LocalBlackBoard(default_registry(), clock, self.bus)
        plugins = PluginManager(lambda: [("flite", "speech", True), ("skiller", "skills", True)])
        components = [NetworkLogger(self.bus), plugins]
        self.server = FawkesServer(self.board, port=0, components=components)

    def populate(self, infos: Iterable[bb.ListedInterface]) -> None:
        """Have the interfaces that a recorded list tells of, with their time stamps and in their order."""
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
    """Acts on messages as the recorded skiller did, and says what that one said."""

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
                getattr(self, f"_{step.what}")(step)
        finally:
            for client in self._clients.values():
                client.close()

    def _connect(self, step: Step) -> None:
        self._clients[step.conn] = RawClient(self._port)

    def _disconnect(self, step: Step) -> None:
        self._clients[step.conn].close()

    def _ask(self, step: Step) -> None:
        self._clients[step.conn].send(self._serials.ours(step.frame))

    def _tell(self, step: Step) -> None:
        got = self._clients[step.conn].take()
        assert got[:2] == step.frame[:2]
        if got[:2] == (ComponentId.BLACKBOARD, bb.BoardKind.OPEN_SUCCESS):
            ours = codec.decode(got)
            assert isinstance(ours, bb.OpenSuccess)
            self._serials.learn(step.message.serial, ours.serial)
        wanted = self._serials.ours(step.frame)
        assert got == wanted or self._same(got, wanted), (got, wanted)
        self.compared += 1


def equal_but_time(got: FawkesFrame, wanted: FawkesFrame) -> bool:
    """Whether data differ only in the time at which the skiller wrote them."""
    if got.component == ComponentId.BLACKBOARD and got.kind in (
        bb.BoardKind.DATA_REFRESHED,
        bb.BoardKind.DATA_CHANGED,
    ):
        start = bb.DATA_HEAD.size
        return got.payload[:start] + got.payload[start + 16 :] == (
            wanted.payload[:start] + wanted.payload[start + 16 :]
        )
    return False


@pytest.mark.parametrize("name", ["skillet-say", "skillet-say-wait"])
def test_skillet(process, name):
    steps = load(name)
    opened = next(step.message for step in steps if step.what == "tell")
    FakeSkiller(process, opened.block, finishes=name == "skillet-say")
    process.board.open_for_reading("SkillerInterface", "Skiller")
    replay = Replay(process, equal_but_time)
    replay.run(steps)
    assert replay.compared == {"skillet-say": 9, "skillet-say-wait": 7}[name]


def test_ffplugin_list(process):
    replay = Replay(process, lambda got, wanted: False)
    replay.run(load("ffplugin-list"))
    assert replay.compared == 1


# -- the log


def equal_but_names(got: FawkesFrame, wanted: FawkesFrame) -> bool:
    if got.component != ComponentId.NETWORK_LOGGER:
        return equal_but_time(got, wanted)
    return _anonymous(got) == _anonymous(wanted)


def _anonymous(line: FawkesFrame) -> tuple[bytes, bytes]:
    """Return the level and the texts of a log line, without its time and serials."""
    level, texts = line.payload[:4], line.payload[LOG_HEAD_SIZE:]
    texts = re.sub(rb"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", b"<serial>", texts)
    return level, re.sub(rb"Remote \d+ ", b"Remote <number> ", texts)


def in_time(steps: list[Step]) -> list[Step]:
    """Leave out the lines about lateness of the recorded Fawkes' main loop."""
    return [
        step
        for step in steps
        if step.what != "tell"
        or step.frame.component != ComponentId.NETWORK_LOGGER
        or step.frame.payload[LOG_HEAD_SIZE:].partition(b"\0")[0] != b"FawkesMainThread"
    ]


def by_connection(steps: list[Step]) -> list[Step]:
    """Compare the log at the end: it and the answers come on two connections, in no order."""
    later = [step for step in steps if step.what == "tell" and step.conn == 0]
    ends = [step for step in steps if step.what == "disconnect"]
    return [step for step in steps if step not in later and step not in ends] + later + ends


def test_fflogview(process):
    steps = in_time(load("fflogview"))
    opened = next(step.message for step in steps if step.conn == 1 and step.what == "tell")
    FakeSkiller(process, opened.block, finishes=True)
    process.board.open_for_reading("SkillerInterface", "Skiller")
    replay = Replay(process, equal_but_names)
    steps = by_connection(steps)
    replay.run(steps)
    log = [step.frame for step in steps if step.what == "tell" and step.conn == 0]
    assert [line.payload[0] for line in log].count(1) == 1  # the level INFO
    assert replay.compared == len(log) + 9


# -- everything of the blackboard


def without_the_leak(steps: list[Step]) -> list[Step]:
    """Leave out, or put right, what follows from opening before the hashes are compared.

    The recorded Fawkes made HashMis and HashMisW, and kept them; later it refused to open HashMisW.
    Ours makes HashMisW when it is opened with the right hash, and it vanishes with its client.
    """
    right: list[Step] = []
    for step in steps:
        message = step.message if step.what == "tell" else None
        if isinstance(message, bb.InterfaceEvent) and message.id.startswith("HashMis"):
            continue
        if isinstance(message, bb.InterfaceList):
            kept = tuple(info for info in message.interfaces if not info.id.startswith("HashMis"))
            step = replace(step, frame=bb.InterfaceList(kept).to_frame())  # noqa: PLW2901
        right.append(step)
    refused = next(
        index
        for index, step in enumerate(right)
        if step.conn == 2
        and step.what == "tell"
        and step.message == bb.OpenFailure(bb.OpenError.WRITER_EXISTS)
    )
    created = bb.InterfaceEvent(CREATED, "TestInterface", "HashMisW").to_frame()
    right[refused : refused + 1] = [Step(conn, "tell", created) for conn in (0, 1, 2)] + [Step(2, "opened")]
    gone = right.index(Step(2, "disconnect"))
    destroyed = bb.InterfaceEvent(DESTROYED, "TestInterface", "HashMisW").to_frame()
    right[gone + 1 : gone + 1] = [Step(conn, "tell", destroyed) for conn in (0, 1)]
    return right


class BbnetReplay(Replay):
    def _opened(self, step: Step) -> None:
        message = self._clients[step.conn].message()
        assert isinstance(message, bb.OpenSuccess)
        assert (message.has_writer, message.num_readers) == (True, 0)


def test_bbnet(process):
    """Every kind of message; all of it equal to the byte, times included: the clients write."""
    steps = without_the_leak(load("bbnet"))
    lists = [
        step.message
        for step in steps
        if step.what == "tell" and step.frame.kind == bb.BoardKind.INTERFACE_LIST
    ]
    process.populate(lists[0].interfaces)
    opened = next(
        step.message for step in steps if step.what == "tell" and step.frame.kind == bb.BoardKind.OPEN_SUCCESS
    )
    infos = {info.uid: info for info in process.board.list_all()}
    assert infos["SkillerInterface::Skiller"].num_readers == 1
    rewrite_skiller(process, opened.block)
    replay = BbnetReplay(process, lambda got, wanted: False)
    replay.run(steps)
    assert replay.compared == sum(step.what == "tell" for step in steps)


def rewrite_skiller(process: Process, block: bytes) -> None:
    """Give the Skiller's interface the recorded content."""
    (memory,) = (m for m in process.board._memories.values() if m.uid == "SkillerInterface::Skiller")
    writer = memory.instances()[-1]
    assert writer.is_writer
    _write(writer, block)
