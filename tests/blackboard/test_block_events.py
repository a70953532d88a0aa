"""Writes on the bus as bytes, for recorders of raw data."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import BlockWrite, Event, EventBus, InterfaceWrite
from cxbridge.interfaces.registry import InterfaceRegistry

START_US = 1_000_000_123_456_789


@pytest.fixture
def bus():
    return EventBus(VirtualClock(START_US))


@pytest.fixture
def writer(bus):
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    return board.open_for_writing("SwitchInterface", "s")


def test_block_event_has_block_at_time_of_write(bus, writer):
    events: list[Event] = []
    bus.subscribe(events.append, BlockWrite)
    writer.enabled = True
    writer.write()
    first = writer.to_bytes()
    bus.clock.sleep_until(START_US + 5)
    writer.write()  # no field was set: the block keeps its time stamp
    writer.enabled = False
    writer.write()
    assert events == [
        BlockWrite(START_US, "SwitchInterface::s", writer.hash, first),
        BlockWrite(START_US + 5, "SwitchInterface::s", writer.hash, first),
        BlockWrite(START_US + 5, "SwitchInterface::s", writer.hash, writer.to_bytes()),
    ]


def test_subscribers_get_values_and_block_of_each_write(bus, writer):
    both: list[Event] = []
    values: list[Event] = []
    bus.subscribe(both.append, InterfaceWrite, BlockWrite)
    bus.subscribe(values.append, InterfaceWrite)
    writer.write()
    assert [type(event) for event in both] == [InterfaceWrite, BlockWrite]
    assert values == both[:1]
