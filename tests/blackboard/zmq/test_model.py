"""A server and three clients against a model: single writer, order, exactly once, late joining, deaths."""

from __future__ import annotations

import os
import tempfile
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from cxbridge.blackboard import EventKind, Listener, errors
from tests.blackboard.samples import SampleInterface
from tests.blackboard.zmq.support import Bench, eventually

SetCount = SampleInterface.MESSAGES["SetCountMessage"]
CLIENTS = st.integers(0, 2)
IDS = st.sampled_from(["a", "b"])


@dataclass
class Shared:
    """What the model knows of an interface."""

    count: int = 0
    writer: tuple[int, Any] | None = None
    queue: deque[tuple[Any, int]] = field(default_factory=deque)  # of the writer: sender's serial, number


@dataclass
class Reader:
    """An instance, what its listener has heard, and what it should have heard."""

    instance: Any
    id: str
    heard: list[int] = field(default_factory=list)
    expected: list[int] = field(default_factory=list)
    sent: int = 0


class Hears(Listener):
    """Notes each value that it reads."""

    def __init__(self, heard: list[int]) -> None:
        self.heard = heard

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        self.heard.append(interface.count)


class Machine(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.bench = Bench("inproc", Path(self.folder.name))
        self.bench.server.start()
        self.boards = [self.bench.client(name=f"client {number}") for number in range(3)]
        self.readers: list[list[Reader]] = [[], [], []]
        self.shared = {"a": Shared(), "b": Shared()}
        self.numbers = 0

    def teardown(self) -> None:
        self.bench.shut_down_clients()
        self.bench.server.stop()
        self.bench.context.term()
        self.folder.cleanup()

    def forget_unused(self, interface_id: str) -> None:
        """Data and messages die with the last instance."""
        shared = self.shared[interface_id]
        if shared.writer is None:
            shared.queue.clear()
            if not any(reader.id == interface_id for readers in self.readers for reader in readers):
                shared.count = 0

    @rule(client=CLIENTS, interface_id=IDS)
    def open_reader(self, client: int, interface_id: str) -> None:
        board = self.boards[client]
        self.bench.settle()
        reader = Reader(board.open_for_reading(SampleInterface, interface_id), interface_id)
        reader.instance.read()
        assert reader.instance.count == self.shared[interface_id].count
        board.register_listener(Hears(reader.heard), reader.instance, EventKind.DATA_REFRESHED)
        self.readers[client].append(reader)

    @rule(client=CLIENTS, interface_id=IDS)
    def open_writer(self, client: int, interface_id: str) -> None:
        shared = self.shared[interface_id]
        try:
            instance = self.boards[client].open_for_writing(SampleInterface, interface_id)
        except errors.WriterActiveError:
            assert shared.writer is not None
        else:
            assert shared.writer is None
            shared.writer = (client, instance)

    @rule(client=CLIENTS, other=CLIENTS, interface_id=IDS, times=st.integers(1, 9))
    def write(self, client: int, other: int, interface_id: str, times: int) -> None:
        shared = self.shared[interface_id]
        if not any(reader.id == interface_id for readers in self.readers for reader in readers):
            self.open_reader(other, interface_id)
        if shared.writer is None:
            self.open_writer(client, interface_id)
        assert shared.writer is not None
        for _ in range(times):
            self.numbers += 1
            shared.count = shared.writer[1].count = self.numbers
            shared.writer[1].write()
            for readers in self.readers:
                for reader in readers:
                    if reader.id == interface_id:
                        reader.expected.append(self.numbers)

    @rule(client=CLIENTS, other=CLIENTS, which=st.integers(0, 5), times=st.integers(1, 6))
    def send(self, client: int, other: int, which: int, times: int) -> None:
        if not self.readers[client]:
            self.open_reader(client, "a")
            if self.shared["a"].writer is None:
                self.open_writer(other, "a")
        reader = self.readers[client][which % len(self.readers[client])]
        shared = self.shared[reader.id]
        for _ in range(times):
            self.numbers += 1
            reader.sent += 1
            try:
                assert reader.instance.msgq_enqueue(SetCount(self.numbers)) == reader.sent
            except errors.NoWriterError:
                assert shared.writer is None
            else:
                assert shared.writer is not None
                shared.queue.append((reader.instance.serial, self.numbers))

    @rule(interface_id=IDS)
    def take(self, interface_id: str) -> None:
        shared = self.shared[interface_id]
        if shared.writer is None:
            return
        while (message := shared.writer[1].msgq_pop()) is not None:
            assert (message.source_id, message.count) == shared.queue.popleft()
        assert not shared.queue

    @rule(interface_id=IDS)
    def close_writer(self, interface_id: str) -> None:
        shared = self.shared[interface_id]
        if shared.writer is not None:
            shared.writer[1].close()
            shared.writer = None
            self.forget_unused(interface_id)

    @rule(client=CLIENTS)
    def close_reader(self, client: int) -> None:
        if self.readers[client]:
            self.bench.settle()
            reader = self.readers[client].pop(0)
            reader.instance.close()
            assert reader.heard == reader.expected
            self.forget_unused(reader.id)

    @rule(client=CLIENTS)
    def die(self, client: int) -> None:
        """End a client's session from the server's side; a new client takes its place."""
        self.bench.settle()
        before = self.bench.server.sessions
        board = self.boards[client]
        board._link._stopping = True  # no goodbye, no reconnecting: as if it was killed
        board._link._wakeup.set()
        (session,) = [s for s in self.bench.server._sessions.values() if s.name == board._link._name]
        self.bench.server.post(self.bench.server._end, session)
        eventually(lambda: self.bench.server.sessions == before - 1)
        board.shutdown()
        self.bench.clients.remove(board)
        self.readers[client].clear()
        for interface_id, shared in self.shared.items():
            if shared.writer is not None and shared.writer[0] == client:
                shared.writer = None
            self.forget_unused(interface_id)
        self.boards[client] = self.bench.client(name=f"again {self.numbers} {id(board)}")

    @precondition(lambda self: any(self.readers))
    @invariant()
    def everybody_heard_everything(self) -> None:
        self.bench.settle()
        for readers in self.readers:
            for reader in readers:
                assert reader.heard == reader.expected
                reader.instance.read()
                assert reader.instance.count == self.shared[reader.id].count
                assert reader.instance.has_writer == (self.shared[reader.id].writer is not None)


TestMachine = Machine.TestCase
TestMachine.settings = settings(
    max_examples=int(os.environ.get("CXBRIDGE_EXAMPLES", "25")),
    stateful_step_count=25,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
