"""The recorder writes the events of its level; a failed writer does not stop the run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import (
    Event,
    EventBus,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    LogLine,
    PlannerCall,
    RuleFired,
)
from cxbridge.trace.formats.base import Attachment, RunWriter
from cxbridge.trace.recorder import Recorder
from tests.trace.runs import goal


class ListWriter(RunWriter):
    """Collects events; fails at event number ``full``."""

    def __init__(self, full: int = 1000) -> None:
        self.events: list[Event] = []
        self.calls: list[str] = []
        self.full = full

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        return level.event_types

    def write(self, event: Event) -> None:
        if len(self.events) >= self.full:
            raise TraceError("disk full")
        self.events.append(event)

    def describe(self, metadata: Mapping[str, str]) -> None:
        self.calls.append(f"describe {dict(metadata)}")

    def attach(self, attachment: Attachment) -> None:
        self.calls.append(f"attach {attachment.name}")

    def flush(self) -> None:
        self.calls.append("flush")

    def close(self) -> None:
        self.calls.append("close")


EVENTS: list[Event] = [
    goal("gen1", "FORMULATED"),
    RuleFired(0, "executive", 1, "a", "f-1"),
    FactChange(0, "executive", True, 1, "goal", "(goal)"),
    InterfaceWrite(0, "A::b", {}),
    InterfaceMessage(0, "A::b", "AMessage", 1, "me", "queued", {}),
    PlannerCall(0, "executive", "plan-1", "gen1", "auto", "d", "(p)", "started", 0, 0, ""),
]
TRANSITIONS = {GoalTransition, InterfaceWrite, InterfaceMessage, PlannerCall}


@pytest.mark.parametrize(
    ("level", "expected"),
    [
        (RecordLevel.TRANSITIONS, TRANSITIONS),
        (RecordLevel.RULES, TRANSITIONS | {RuleFired}),
        (RecordLevel.FACTS, TRANSITIONS | {RuleFired, FactChange}),
    ],
)
def test_level_selects_event_types(level: RecordLevel, expected: set[type[Event]]) -> None:
    bus, writer = EventBus(VirtualClock()), ListWriter()
    with Recorder(bus, [writer], level):
        assert bus.wants(LogLine)
        assert bus.wants(RuleFired) is (RuleFired in expected)
        for event in EVENTS:
            bus.emit(event)
    assert {type(event) for event in writer.events} == expected
    assert not bus.wants(GoalTransition)


def test_recorder_forwards_calls_and_closes_once() -> None:
    bus, writer = EventBus(VirtualClock()), ListWriter()
    recorder = Recorder(bus, [writer])
    recorder.describe({"spec": "test"})
    recorder.attach(Attachment("a.clp", "text/plain", b""))
    recorder.flush()
    recorder.close()
    recorder.close()
    bus.emit(EVENTS[0])
    assert writer.calls == ["describe {'spec': 'test'}", "attach a.clp", "flush", "close"]
    assert not writer.events


def test_events_of_several_threads_are_written_in_turn() -> None:
    class SlowWriter(ListWriter):
        busy = False

        def write(self, event: Event) -> None:
            assert not self.busy
            self.busy = True
            time.sleep(0.001)
            super().write(event)
            self.busy = False

    bus, writer = EventBus(VirtualClock()), SlowWriter()
    with Recorder(bus, [writer]), ThreadPoolExecutor(4) as threads:
        for future in [threads.submit(bus.emit, EVENTS[0]) for _ in range(40)]:
            future.result()
    assert len(writer.events) == 40


def test_full_disk_ends_recording_and_not_run() -> None:
    bus, broken, healthy = EventBus(VirtualClock()), ListWriter(full=1), ListWriter()
    with Recorder(bus, [broken, healthy], RecordLevel.FACTS) as recorder:
        for event in EVENTS:
            bus.emit(event)
        recorder.flush()
    assert len(recorder.errors) == 1
    assert len(broken.events) == 1
    assert broken.calls == ["close"]
    assert healthy.events == EVENTS
