"""Writes a run in the layout of Fawkes' text log: see docs/formats.md."""

from __future__ import annotations

import time
from pathlib import Path

from cxbridge.clock import split_us
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, FactChange, LogLine, RuleFired
from cxbridge.printing import to_entry, to_record
from cxbridge.trace.formats.base import RunWriter
from cxbridge.trace.formats.opening import open_alone

_BUFFER = 64 * 1024
_FLUSH_SECONDS = 0.5


class FawkesLogWriter(RunWriter):
    """A text log as a Fawkes with CLIPS debugging writes it: log lines, facts and firings, at any level.

    Whatever was written more than half a second of real time before the last entry is safe in the file.

    :param path: the file; one that is there is replaced.
    :param utc: write times of day in UTC; else in the machine's zone, as Fawkes does. A run on a virtual
        clock wants UTC: its file is then the same on every machine.
    :raises TraceError: when the file cannot be made.
    """

    def __init__(self, path: str | Path, *, utc: bool = False) -> None:
        self.path = Path(path)
        self._broken_down = time.gmtime if utc else time.localtime
        self._second = -1
        self._flushed = time.monotonic()
        self._clock = ""
        try:
            self._file = open_alone(self.path, _BUFFER)
        except OSError as error:
            raise TraceError(f"cannot be written: {error.strerror}", file=path) from error

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - see the class
        """Return log lines, firings and facts: a log without them could not be read as a run."""
        return frozenset({LogLine, RuleFired, FactChange})

    def write(self, event: Event) -> None:
        """Write one entry."""
        if isinstance(event, LogLine):
            head = f"{event.level.value} {self._time(event.time_us)} {to_record(event.component)}"
            entry = f"{head}: {to_entry(event.text)}\n"
        elif isinstance(event, FactChange):
            arrow = "==>" if event.asserted else "<=="
            entry = (
                f"D {self._time(event.time_us)} CLIPS ({to_record(event.env)}):"
                f" {arrow} f-{event.index:<5d} {to_entry(event.text)}\n"
            )
        elif isinstance(event, RuleFired):
            entry = (
                f"D {self._time(event.time_us)} CLIPS ({to_record(event.env)}):"
                f" FIRE {event.number:4d} {to_record(event.rule)}: {to_record(event.basis)}\n"
            )
        else:
            return
        try:
            self._file.write(_encode(entry))
        except OSError as error:
            raise TraceError(f"cannot be written: {error.strerror}", file=self.path) from error
        if time.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Bring the entries into the file."""
        self._flushed = time.monotonic()
        try:
            self._file.flush()
        except OSError as error:
            raise TraceError(f"cannot be written: {error.strerror}", file=self.path) from error

    def close(self) -> None:
        """Close the file."""
        if not self._file.closed:
            try:
                self._file.close()
            except OSError as error:
                raise TraceError(f"cannot be written: {error.strerror}", file=self.path) from error

    def _time(self, time_us: int) -> str:
        """Return the time of day, ``HH:MM:SS.uuuuuu``; the seconds are worked out once each."""
        second, fraction = split_us(time_us)
        if second != self._second:
            parts = self._broken_down(second)
            self._second = second
            self._clock = f"{parts.tm_hour:02d}:{parts.tm_min:02d}:{parts.tm_sec:02d}"
        return f"{self._clock}.{fraction:06d}"


def _encode(text: str) -> bytes:
    """Return the text in UTF-8; bytes that came in as something else go out as they were."""
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        return text.encode("utf-8", "backslashreplace")
