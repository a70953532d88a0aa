"""Recordings for replays, and a listener for the replayed writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cxbridge.blackboard import BlackBoard, Listener
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, LogLine
from cxbridge.events import Level as LogLevel
from cxbridge.interfaces.instance import Interface
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run

BEGIN_US = 1_700_000_000_000_000
UID = "SwitchInterface::s"


def write(at_ms: float, value: float, uid: str = UID, **more: Any) -> InterfaceWrite:
    """Return a write of a switch, milliseconds after the begin."""
    values = {"enabled": True, "value": value, "history": 0.0, "short_activations": 0, "long_activations": 0}
    values["activation_count"] = 0
    return InterfaceWrite(BEGIN_US + round(at_ms * 1000), uid, values | more)


def message(at_ms: float, uid: str = UID, kind: str = "SetMessage", **values: Any) -> InterfaceMessage:
    """Return a message to a switch."""
    return InterfaceMessage(BEGIN_US + round(at_ms * 1000), uid, kind, 1, "sender", "queued", values)


def begin() -> LogLine:
    """Return the first event of a recording."""
    return LogLine(BEGIN_US, LogLevel.INFO, "test", "it begins")


def record(path: Path, *events: Event) -> Path:
    """Write a recording that begins at :data:`BEGIN_US`."""
    with McapWriter(path) as writer:
        for event in (begin(), *events):
            writer.write(event)
    return path


def recorded(folder: Path, *events: Event) -> Any:
    """Return an open recording."""
    return open_run(record(folder / "run.mcap", *events))


class WriteListener(Listener):
    """Reads each write of an interface.

    :ivar writes: value and time stamp of each write; ``changes``: the number of writes with changes.
    """

    def __init__(self, board: BlackBoard, uid: str = UID) -> None:
        self.writes: list[tuple[float, int]] = []
        self.changes = 0
        kind, _, interface_id = uid.partition("::")
        self.reader: Any = board.open_for_reading(kind, interface_id, owner="listener")
        board.register_listener(self, self.reader)

    @property
    def values(self) -> list[float]:
        return [value for value, _ in self.writes]

    def data_refreshed(self, interface: Interface) -> None:
        self.reader.read()
        self.writes.append((self.reader.value, self.reader.timestamp_us))

    def data_changed(self, interface: Interface) -> None:
        self.changes += 1
