"""The blackboard against a small model of it: any order of operations of a few interfaces."""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass, field
from typing import Any
from uuid import UUID

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, initialize, invariant, multiple, rule

from cxbridge.blackboard import EventKind, LocalBlackBoard, errors
from cxbridge.clock import VirtualClock
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SampleInterface, SampleRegistry
from tests.support import many

IDS = ("a", "b")


@dataclass
class Memory:
    """What the model knows of an interface: the shared data and who has it open."""

    data: int = 0
    stamp: int = 0
    version: int = 0  # counts writes with a new time stamp
    readers: list[UUID] = field(default_factory=list)
    writer: UUID | None = None
    queue: deque[tuple[UUID, int, int]] = field(default_factory=deque)  # sender, id, content


@dataclass
class Handle:
    """An instance under test, and what the model knows of it."""

    instance: Any
    id: str
    count: int = 0  # the private copy
    stamp: int = 0  # its time stamp
    pending: bool = False
    differs: bool = False
    seen: int = 0
    sent: int = 0


class BoardMachine(RuleBasedStateMachine):
    readers = Bundle("readers")
    writers = Bundle("writers")

    def __init__(self) -> None:
        super().__init__()
        self.clock = VirtualClock()
        numbers = itertools.count(1)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock, serials=lambda: UUID(int=next(numbers)))
        self.memories: dict[str, Memory] = {}
        self.events = Recorder()
        self.expected: list[tuple[object, ...]] = []
        self.heard_on: set[str] = set()

    @initialize()
    def watch(self) -> None:
        self.board.register_observer(self.events)

    def uid(self, interface_id: str) -> str:
        return f"SampleInterface::{interface_id}"

    def expect(self, interface_id: str, *kinds_and_details: tuple[object, ...]) -> None:
        if interface_id in self.heard_on:
            for kind, *details in kinds_and_details:
                self.expected.append((kind, self.uid(interface_id), *details))

    def enter(self, interface_id: str) -> Memory:
        if interface_id not in self.memories:
            self.memories[interface_id] = Memory()
            self.expected.append(("created", self.uid(interface_id)))
        return self.memories[interface_id]

    def leave(self, interface_id: str) -> None:
        memory = self.memories[interface_id]
        if not memory.readers and memory.writer is None:
            del self.memories[interface_id]
            self.heard_on.discard(interface_id)
            self.expected.append(("destroyed", self.uid(interface_id)))

    @rule(target=readers, interface_id=st.sampled_from(IDS))
    def open_for_reading(self, interface_id: str) -> Handle:
        reader = self.board.open_for_reading(SampleInterface, interface_id)
        self.enter(interface_id).readers.append(reader.serial)
        self.expect(interface_id, ("+reader", reader.serial))
        return Handle(reader, interface_id)

    @rule(target=writers, interface_id=st.sampled_from(IDS))
    def open_for_writing(self, interface_id: str) -> Any:
        known = self.memories.get(interface_id)
        if known is not None and known.writer is not None:
            try:
                self.board.open_for_writing(SampleInterface, interface_id)
            except errors.WriterActiveError:
                return multiple()
            raise AssertionError("a second writer")
        writer = self.board.open_for_writing(SampleInterface, interface_id)
        self.enter(interface_id).writer = writer.serial
        self.expect(interface_id, ("+writer", writer.serial))
        return Handle(writer, interface_id)

    @rule(handle=writers)
    def listen(self, handle: Handle) -> None:
        """The model's one listener of an interface sits on the writer; it ends with it."""
        if handle.id not in self.heard_on:
            self.board.register_listener(self.events, handle.instance, *EventKind)
            self.heard_on.add(handle.id)

    @rule(handle=writers, count=st.integers(0, 3))
    def set_count(self, handle: Handle, count: int) -> None:
        handle.differs |= count != handle.count
        handle.pending = True
        handle.count = count
        handle.instance.count = count

    @rule(handle=writers)
    def write(self, handle: Handle) -> None:
        memory = self.memories[handle.id]
        handle.instance.write()
        if handle.pending:
            handle.stamp = self.clock.now_us()
        if handle.pending or memory.stamp != handle.stamp:
            memory.version += 1
        memory.data, memory.stamp = handle.count, handle.stamp
        self.expect(handle.id, ("refreshed",), *([("changed",)] if handle.differs else []))
        handle.pending = handle.differs = False

    @rule(handle=st.one_of(readers, writers))
    def read(self, handle: Handle) -> None:
        memory = self.memories[handle.id]
        refreshed = handle.instance.read()
        if not handle.instance.is_writer:
            assert refreshed == handle.instance.refreshed == (memory.version > handle.seen)
            handle.seen = memory.version
        handle.count, handle.stamp = memory.data, memory.stamp

    @rule(handle=readers, count=st.integers(0, 3))
    def send(self, handle: Handle, count: int) -> None:
        memory = self.memories[handle.id]
        handle.sent += 1
        message = SampleInterface.SetCountMessage(count)
        try:
            assert handle.instance.msgq_enqueue(message) == handle.sent
        except errors.NoWriterError:
            assert memory.writer is None
            return
        assert memory.writer is not None
        self.expect(handle.id, ("message", "SetCountMessage"))
        memory.queue.append((handle.instance.serial, handle.sent, count))

    @rule(handle=writers)
    def pop(self, handle: Handle) -> None:
        queue = self.memories[handle.id].queue
        message = handle.instance.msgq_pop()
        got = None if message is None else (message.source_id, message.id, message.count)
        assert got == (queue.popleft() if queue else None)

    @rule(step=st.integers(1, 1000))
    def wait(self, step: int) -> None:
        self.clock.sleep_until(self.clock.now_us() + step)

    @rule(handle=consumes(readers))
    def close_reader(self, handle: Handle) -> None:
        handle.instance.close()
        self.memories[handle.id].readers.remove(handle.instance.serial)
        self.expect(handle.id, ("-reader", handle.instance.serial))
        self.leave(handle.id)

    @rule(handle=consumes(writers))
    def close_writer(self, handle: Handle) -> None:
        handle.instance.close()
        memory = self.memories[handle.id]
        memory.writer = None
        memory.queue.clear()
        self.expect(handle.id, ("-writer", handle.instance.serial))
        self.heard_on.discard(handle.id)
        self.leave(handle.id)

    @rule(handle=st.one_of(readers, writers))
    def look(self, handle: Handle) -> None:
        memory = self.memories[handle.id]
        instance = handle.instance
        assert (instance.count, instance.timestamp_us) == (handle.count, handle.stamp)
        assert (instance.has_writer, instance.num_readers) == (memory.writer is not None, len(memory.readers))
        if instance.is_writer:
            assert (instance.refreshed, instance.changed) == (handle.pending, handle.differs)
            assert instance.msgq_size() == len(memory.queue)

    @invariant()
    def the_same_was_heard(self) -> None:
        assert self.events.take() == self.expected
        self.expected = []

    @invariant()
    def the_same_interfaces_are_listed(self) -> None:
        listed = {info.id: info for info in self.board.list_all()}
        assert list(listed) == list(self.memories)
        for interface_id, memory in self.memories.items():
            info = listed[interface_id]
            assert (info.has_writer, info.num_readers) == (memory.writer is not None, len(memory.readers))
            assert info.timestamp_us == memory.stamp


TestBoardMachine = BoardMachine.TestCase
TestBoardMachine.settings = settings(
    max_examples=many(100, 25),
    stateful_step_count=40,
    deadline=None,
    derandomize=True,  # the same examples on each machine, however busy it is
    suppress_health_check=list(HealthCheck),
)
