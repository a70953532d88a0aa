"""Writes a run as mcap with the log a second time, in the form that Foxglove's Log panel shows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from cxbridge.events import Event, Level, LogLine
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.codec import dump
from cxbridge.trace.formats.mcap.writer import McapWriter

TOPIC = "/foxglove/log"
"""The topic of the second log. Readers of runs go by the schema's name, and pass it over."""

SCHEMA = "foxglove.Log"
"""The name by which Foxglove knows a log line."""

LEVELS = {Level.DEBUG: 1, Level.INFO: 2, Level.WARN: 3, Level.ERROR: 4}
"""Foxglove's numbers of the levels."""

_WHOLE = {"type": "integer", "minimum": 0}
_TEXT = {"type": "string"}
_FIELDS = {
    "timestamp": {"type": "object", "title": "time", "properties": {"sec": _WHOLE, "nsec": _WHOLE}},
    "level": _WHOLE,
    "message": _TEXT,
    "name": _TEXT,
    "file": _TEXT,
    "line": _WHOLE,
}


class FoxgloveWriter(McapWriter):
    """An mcap file as :class:`McapWriter` makes it, and a channel more."""

    _log: int | None = None

    def _messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages; a log line is two."""
        for event in events:
            yield from super()._messages((event,))
            if isinstance(event, LogLine):
                yield self._line(event)

    def _line(self, event: LogLine) -> tuple[int, int, bytes]:
        """Return a log line as Foxglove wants it."""
        seconds, microseconds = divmod(max(event.time_us, 0), 1_000_000)
        line = {
            "timestamp": {"sec": seconds, "nsec": microseconds * 1000},
            "level": LEVELS[event.level],
            "message": event.text,
            "name": event.component,
            "file": "",
            "line": 0,
        }
        data = dump(line).encode("utf-8", "backslashreplace")
        if self._log is None:
            schema = {"title": SCHEMA, "type": "object", "properties": _FIELDS, "required": list(_FIELDS)}
            number = self._mcap.add_schema(SCHEMA, "jsonschema", dump(schema).encode())
            self._log = self._mcap.add_channel(TOPIC, "json", number)
        return self._log, event.time_us * 1000, data


def open_copy(path: Path, _registry: InterfaceRegistry) -> FoxgloveWriter:
    """Open a file for a copy of a run."""
    return FoxgloveWriter(path)
