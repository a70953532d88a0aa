"""Reader and writer of the text log of Fawkes; docs/formats.md has its layout.

With CLIPS debugging, Fawkes logs each firing and each change of a fact. The reader makes events of these
lines, and transitions of the facts; all other entries become log lines.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from cxbridge.clipstext.facts import FactSyntaxError, template_of
from cxbridge.clock import MICROSECONDS, split_us
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, FactChange, Level, LogLine, RuleFired
from cxbridge.file_access import make_parent_folder
from cxbridge.history.transitions import TransitionTracker
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.printing import escape_log_entry, escape_record, unescape_record
from cxbridge.trace.formats.base import CopyFormat, Format, RecordingInfo, Run, StreamWriter
from cxbridge.trace.formats.files import MAX_LINE_BYTES, open_exclusively, read_lines, writing

# An entry, e.g. D 12:34:56.123456 CLIPS (executive): FIRE 1 my-rule: f-1,*
_ENTRY_LINES = re.compile(r"([DIWE]) (\d\d:\d\d:\d\d)\.(\d{6}) (.*?): (.*)", re.DOTALL)
_TIME_STAMP = re.compile(r"[DIWE] \d\d:\d\d:\d\d\.\d{6} ")
_FIRST_ENTRY = re.compile(rb"^[DIWE] \d\d:\d\d:\d\d\.\d{6} .*?: ", re.MULTILINE)
# Texts of entries with CLIPS debugging: ==> f-12 (time 1 2), and FIRE 1 my-rule: f-1,*
# Numbers of up to 18 digits fit into 64 bits.
_FACT = re.compile(r"(==>|<==) f-(\d{1,18}) +(\(.*)", re.DOTALL)
_FIRE = re.compile(r"FIRE +(\d{1,18}) ([^: ]+):(?: (.*))?", re.DOTALL)
_ENVIRONMENT = re.compile(r"CLIPS \((.+)\)")

_FACT_STARTS = ("==> f-", "<== f-")
_CLIPS_STARTS = (*_FACT_STARTS, "FIRE ")

_LEVELS = {level.value: level for level in Level}
_BUFFER_SIZE = 64 * 1024  # in bytes; chosen freely
_FLUSH_INTERVAL_S = 0.5  # in real time: a killed run loses little
_DAY_US = 24 * 3600 * MICROSECONDS
_MAX_DELAY_US = 3600 * MICROSECONDS  # how far entries may be out of order; chosen freely


class FawkesLog(Run):
    """A text log of Fawkes.

    The log has only times of day in the time zone of its machine. The times of the run count from midnight of
    1970-01-01, as if that zone were UTC, and increase past each midnight.
    """

    format = "fawkes-log"

    def __iter__(self) -> Iterator[Event]:
        """Yield log lines, firings, and fact changes with their transitions."""
        trackers: dict[str, TransitionTracker] = {}
        day_counter = _DayCounter()
        for line, (letter, time_of_day, fraction, component, text) in self._join_entries():
            time_us = day_counter.to_time_us(time_of_day, fraction)
            env = _find_environment(component) if letter == "D" else None
            event = parse_clips_event(time_us, env, text) if env is not None else None
            if event is None:
                yield LogLine(time_us, _LEVELS[letter], unescape_record(component), unescape_record(text))
                continue
            transition = None
            if type(event) is FactChange:
                tracker = trackers.setdefault(event.env, TransitionTracker(event.env))
                try:
                    transition = tracker.track_change(event)
                except FactSyntaxError as error:
                    self.note(f"line {line}: fact f-{event.index} cannot be read: {error}")
                    continue
            yield event
            if transition is not None:
                yield transition

    def _join_entries(self) -> Iterator[tuple[int, tuple[str, ...]]]:
        """Yield the line number of each entry, and its fields: level, time of day, fraction, component, text.

        Fawkes ends an entry when CLIPS prints a line feed alone, even within a string of a fact. The rest of
        the fact is then the next entry, which is joined to the entry of the fact.
        """
        unfinished: tuple[int, tuple[str, ...]] | None = None
        for number, entry in self._read_entries():
            match, line = _ENTRY_LINES.match(entry), number
            if match is None:
                self.note(f"line {line}: not a log entry, left out")
                continue
            fields = match.groups()
            component, text = fields[-2:]
            if unfinished is not None:
                fact_line, (*stamp, fact_component, fact) = unfinished
                if (
                    component == fact_component
                    and not text.startswith(_CLIPS_STARTS)
                    and len(fact) < MAX_LINE_BYTES  # a fact without an end must not fill the memory
                ):
                    text = f"{fact}\n{text}"
                    fields, line = (*stamp, component, text), fact_line
                else:
                    yield unfinished
                unfinished = None
            if text.startswith(_FACT_STARTS) and not text.endswith(")") and _find_environment(component):
                unfinished = line, fields
            else:
                yield line, fields
        if unfinished is not None:
            yield unfinished

    def _read_entries(self) -> Iterator[tuple[int, str]]:
        """Yield the number of the first line, and the text of each entry.

        A line without a time continues the previous entry.

        :raises TraceError: if the file cannot be read, or an entry is longer than `MAX_LINE_BYTES`.
        """
        first_number, lines, size, is_last_complete = 0, list[str](), 0, True
        for number, text, is_complete in read_lines(self.path):
            is_last_complete = is_complete
            if _TIME_STAMP.match(text):
                if lines:
                    yield first_number, "\n".join(lines)
                first_number, lines, size = number, [text], len(text)
            elif not lines:
                self.note(f"line {number}: text before the first entry, left out")
            else:
                size += len(text) + 1
                # a binary file may start like a log, and must not fill the memory
                if size > MAX_LINE_BYTES:
                    raise TraceError(
                        f"the entry has more than {MAX_LINE_BYTES >> 20} MiB",
                        file=self.path,
                        line=first_number,
                    )
                lines.append(text)
        if lines:
            if not is_last_complete:
                self.note(f"line {first_number}: the file ends within this entry")
            yield first_number, "\n".join(lines)


class _DayCounter:
    """Converts times of day to continuous times.

    Entries may be a little out of order, also around midnight. A step back of more than half a day passes
    midnight. A step forward of almost a day returns to the day before; a shorter one is a quiet time.
    """

    def __init__(self) -> None:
        self._last_us = 0  # the time of day of the last entry
        self._midnight_us = 0

    def to_time_us(self, time_of_day: str, fraction: str) -> int:
        """Return microseconds since the midnight before the first entry.

        :param time_of_day: ``HH:MM:SS``.
        :param fraction: six digits, microseconds.
        """
        hour, minute, second = map(int, time_of_day.split(":"))
        time_of_day_us = ((hour * 60 + minute) * 60 + second) * MICROSECONDS + int(fraction)
        step_us = time_of_day_us - self._last_us
        if step_us < -_DAY_US // 2:
            self._midnight_us += _DAY_US
        elif step_us > _DAY_US - _MAX_DELAY_US and self._midnight_us:  # no time precedes the first midnight
            self._midnight_us -= _DAY_US
        self._last_us = time_of_day_us
        return self._midnight_us + time_of_day_us


@lru_cache(maxsize=256)  # many lines name the same few components
def _find_environment(component: str) -> str | None:
    match = _ENVIRONMENT.fullmatch(component)
    return unescape_record(match.group(1)) if match else None


def parse_clips_event(time_us: int, env: str, text: str) -> Event | None:
    """Return the event in a debug line of a CLIPS environment; None for any other line.

    :param text: the line without level, time and component.
    """
    if text.startswith(_FACT_STARTS):
        match = _FACT.match(text)
        if match:
            arrow, index, fact = match.groups()
            fact = unescape_record(fact)
            return FactChange(time_us, env, arrow == "==>", int(index), template_of(fact), fact)
    elif text.startswith("FIRE "):
        match = _FIRE.match(text)
        if match:
            number, rule, basis = match.groups()
            return RuleFired(time_us, env, int(number), unescape_record(rule), unescape_record(basis or ""))
    return None


class FawkesLogWriter(StreamWriter):
    """A text log as Fawkes writes it with CLIPS debugging: log lines, facts and firings.

    A write flushes the file if the last flush was more than half a second of real time ago, so that a killed
    run loses few lines.

    :param path: replaced if it exists, unless another process writes the file.
    :param uses_utc: whether times of day are in UTC instead of the machine's time zone, which Fawkes uses:
        the log of a run on the virtual clock is then the same on every machine.
    :raises TraceError: if the file cannot be created, or another process writes the file.
    """

    def __init__(self, path: str | Path, *, uses_utc: bool = False) -> None:
        path = Path(path)
        with writing(path):
            super().__init__(path, open_exclusively(path, _BUFFER_SIZE))
        self._to_time_of_day = time.gmtime if uses_utc else time.localtime
        self._last_second: int | None = None
        self._last_flush_s = time.monotonic()
        self._last_time_of_day = ""  # of `_last_second`

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - the log has the same events at any level
        """Return log lines, firings and facts, from which a reader makes the run."""
        return frozenset({LogLine, RuleFired, FactChange})

    def write(self, event: Event) -> None:
        if isinstance(event, LogLine):
            level, component, text = event.level.value, event.component, escape_log_entry(event.text)
        elif isinstance(event, FactChange):
            level, component = Level.DEBUG.value, f"CLIPS ({event.env})"
            arrow = "==>" if event.asserted else "<=="
            text = f"{arrow} f-{event.index:<5d} {escape_log_entry(event.text)}"
        else:
            assert isinstance(event, RuleFired)
            level, component = Level.DEBUG.value, f"CLIPS ({event.env})"
            text = f"FIRE {event.number:4d} {escape_record(event.rule)}: {escape_record(event.basis)}"
        entry = f"{level} {self._format_time(event.time_us)} {escape_record(component)}: {text}\n"
        with writing(self.path):
            self._file.write(_encode_text(entry))
        if time.monotonic() - self._last_flush_s > _FLUSH_INTERVAL_S:
            self.flush()

    def flush(self) -> None:
        self._last_flush_s = time.monotonic()
        super().flush()

    def _format_time(self, time_us: int) -> str:
        """Return the time of day, ``HH:MM:SS.uuuuuu``."""
        # most events share the second of the last event
        second, fraction = split_us(time_us)
        if second != self._last_second:
            time_of_day = self._to_time_of_day(second)
            self._last_second = second
            self._last_time_of_day = (
                f"{time_of_day.tm_hour:02d}:{time_of_day.tm_min:02d}:{time_of_day.tm_sec:02d}"
            )
        return f"{self._last_time_of_day}.{fraction:06d}"


def _encode_text(text: str) -> bytes:
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:  # a surrogate that stands for no byte
        return text.encode("utf-8", "backslashreplace")


def open_recording(path: Path, recording_info: RecordingInfo) -> FawkesLogWriter:
    """Open a log for the recording of a run."""
    return FawkesLogWriter(make_parent_folder(path), uses_utc=recording_info.uses_utc)


def open_copy(path: Path, _registry: InterfaceRegistry) -> FawkesLogWriter:
    """Open a file for a copy of a run, in UTC: a converted text log keeps its times of day."""
    return FawkesLogWriter(path, uses_utc=True)


FORMATS = (
    Format(
        "fawkes-log",
        rank=70,
        recognises=lambda _, head: _FIRST_ENTRY.search(head) is not None,
        reader=f"{__name__}:FawkesLog",
    ),
)
RECORDING = f"{__name__}:open_recording"
COPIES = (CopyFormat("fawkes-log", rank=20, writer=f"{__name__}:open_copy"),)
