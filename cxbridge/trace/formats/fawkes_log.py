"""Reads the text log of Fawkes (and of ``cxbridge run --log``): see docs/formats.md for its layout."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, Level, LogLine, RuleFired
from cxbridge.trace.facts import FactSyntaxError, parse_fact, template_of
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.lines import MAX_LINE, read_lines
from cxbridge.transitions import FORGETFUL_TEMPLATES, TRACKED_TEMPLATES, TransitionTracker

_ENTRY = re.compile(r"([DIWE]) (\d\d):(\d\d):(\d\d)\.(\d{6}) (.*?): (.*)", re.DOTALL)
_STAMP = re.compile(r"[DIWE] \d\d:\d\d:\d\d\.\d{6} ")
_HEAD = re.compile(rb"^[DIWE] \d\d:\d\d:\d\d\.\d{6} .*?: ", re.MULTILINE)
_FACT = re.compile(r"(==>|<==) f-(\d+) +(\(.*)", re.DOTALL)
_FIRE = re.compile(r"FIRE +(\d+) ([^: ]+):(?: (.*))?", re.DOTALL)
_ENV = re.compile(r"CLIPS \((.+)\)")

_DAY_US = 24 * 3600 * MICROSECONDS


@dataclass(slots=True)
class _Entry:
    """One entry of the log: its first line, and those that follow without a stamp."""

    line: int
    lines: list[str]
    size: int
    whole: bool


class FawkesLog(Run):
    """A text log of Fawkes.

    The log tells the time of day only, in the zone of the machine that wrote it: times here count from
    midnight of 1970-01-01 as if that were UTC, and go on over midnight.
    """

    format = "fawkes-log"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003 - the content decides
        """Whether the head holds at least one entry."""
        return _HEAD.search(head) is not None

    def __iter__(self) -> Iterator[Event]:
        """Yield log lines, firings and fact changes, and after a fact the transition that it means."""
        trackers: dict[str, TransitionTracker] = {}
        days = _Days()
        for entry in self._entries():
            match = _ENTRY.match("\n".join(entry.lines))
            if match is None:
                self.note(f"line {entry.line}: no entry of a log, left out")
                continue
            letter, hour, minute, second, fraction, component, text = match.groups()
            seconds = (int(hour) * 60 + int(minute)) * 60 + int(second)
            time_us = days.absolute(seconds * MICROSECONDS + int(fraction))
            env = _ENV.fullmatch(component) if letter == "D" else None
            event = clips_event(time_us, env.group(1), text) if env else None
            if event is None:
                yield LogLine(time_us, Level(letter), component, text)
                continue
            transition = None
            wanted = (
                FORGETFUL_TEMPLATES
                if isinstance(event, FactChange) and not event.asserted
                else TRACKED_TEMPLATES
            )
            if isinstance(event, FactChange) and event.template in wanted:
                tracker = trackers.setdefault(event.env, TransitionTracker(event.env))
                try:
                    if event.asserted:
                        transition = tracker.fact(time_us, *parse_fact(event.text))
                    else:
                        tracker.retracted(*parse_fact(event.text))
                except FactSyntaxError as error:
                    self.note(f"line {entry.line}: fact f-{event.index} is not readable: {error}")
                    continue
            yield event
            if transition is not None:
                yield transition

    def _entries(self) -> Iterator[_Entry]:
        """Put lines together to entries: a line without a stamp goes on with the entry before it."""
        entry: _Entry | None = None
        for number, text, whole in read_lines(self.path):
            if _STAMP.match(text):
                if entry:
                    yield entry
                entry = _Entry(number, [text], len(text), whole)
            elif entry is None:
                self.note(f"line {number}: text before the first entry, left out")
            else:
                entry.size += len(text) + 1
                if entry.size > MAX_LINE:
                    raise TraceError(
                        f"an entry of more than {MAX_LINE >> 20} MiB", file=self.path, line=entry.line
                    )
                entry.lines.append(text)
                entry.whole = whole
        if entry:
            if not entry.whole:
                self.note(f"line {entry.line}: the file ends within this entry")
            yield entry


class _Days:
    """Times of day to times that go on: a step back by more than half a day is midnight."""

    def __init__(self) -> None:
        self._last = 0
        self._midnight = 0

    def absolute(self, time_of_day_us: int) -> int:
        """Return microseconds since the midnight before the first entry."""
        if self._last - time_of_day_us > _DAY_US // 2:
            self._midnight += _DAY_US
        self._last = time_of_day_us
        return self._midnight + time_of_day_us


def clips_event(time_us: int, env: str, text: str) -> Event | None:
    """Return what a debug line of a CLIPS environment tells, None when it is just text."""
    if text.startswith(("==> f-", "<== f-")):
        match = _FACT.match(text)
        if match:
            arrow, index, fact = match.groups()
            return FactChange(time_us, env, arrow == "==>", int(index), template_of(fact), fact)
    elif text.startswith("FIRE "):
        match = _FIRE.match(text)
        if match:
            number, rule, basis = match.groups()
            return RuleFired(time_us, env, int(number), rule, basis or "")
    return None
