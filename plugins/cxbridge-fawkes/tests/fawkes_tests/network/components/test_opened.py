"""A client that opens an interface during a write gets that write once."""

from __future__ import annotations

from typing import Any
from uuid import UUID

import pytest

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard, listening
from cxbridge.clock import VirtualClock
from cxbridge_fawkes.network.components.opened import OpenedInstance
from tests.blackboard.samples import SampleInterface, SampleRegistry


class RecordedFrames:
    """A session that records the sent frames."""

    def __init__(self) -> None:
        self.sent: list[str] = []

    def send(self, frames: bytes) -> None:
        del frames
        self.sent.append("opened")

    def send_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        del serial
        count = SampleInterface.SCHEMA.field("count")
        assert count is not None
        number = int.from_bytes(block[count.offset : count.offset + 4], "little")
        self.sent.append(f"{'changed' if changed else 'refreshed'} {number}")


class Announces(Listener):
    """Announces an instance to its client at a step of a write."""

    def __init__(self, step: EventKind) -> None:
        self.step = step
        self.opened: OpenedInstance

    def _announce_at(self, step: EventKind) -> None:
        if step is self.step:
            self.step = EventKind.READER_ADDED  # once
            self.opened.announce()

    def data_refreshed(self, interface: Any) -> None:
        del interface
        self._announce_at(EventKind.DATA_REFRESHED)

    def data_changed(self, interface: Any) -> None:
        del interface
        self._announce_at(EventKind.DATA_CHANGED)

    def reader_added(self, interface: Any, serial: UUID) -> None:
        del interface, serial


@pytest.mark.parametrize("first", [False, True], ids=["after listener", "before listener"])
@pytest.mark.parametrize("step", [EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED])
def test_write_during_open_is_in_open_success_only(step: EventKind, first: bool) -> None:
    """A client that opens between the two events of a write must not get CHANGED alone."""
    board = LocalBlackBoard(SampleRegistry(), VirtualClock())
    writer = board.open_for_writing(SampleInterface, "a")
    session, announces = RecordedFrames(), Announces(step)
    table = []
    board.open_for_reading(SampleInterface, "a", listen=lambda _, listeners: table.append(listeners))
    if first:
        listening(announces)(writer, table[0])

    def listen(instance: Any, listeners: Any) -> None:
        announces.opened = OpenedInstance(instance, session, lambda: 0)  # type: ignore[arg-type] # only the needed part
        listening(announces.opened)(instance, listeners)

    board.open_for_reading(SampleInterface, "a", listen=listen)
    listening(announces)(writer, table[0])
    for number in (5, 6):
        writer.count = number
        writer.write()
    assert session.sent == ["opened", "refreshed 6", "changed 6"]
