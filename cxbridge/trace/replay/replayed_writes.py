"""The writes that a replay repeats, each with its position in the recording.

The clock of a recorded machine may have been set, and writes may be out of order. Positions therefore count
from the first event, and never decrease; see docs/recording.md, section "Time".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.patterns import Pattern
from cxbridge.clock import MICROSECONDS
from cxbridge.events import InterfaceWrite
from cxbridge.history.monotonic import MonotonicClock
from cxbridge.trace.formats.base import Run


@dataclass(frozen=True, slots=True)
class ReplaySelection:
    """The interfaces and the time to replay.

    :param patterns: the patterns of the interfaces; empty: all interfaces.
    :param start_s: the start in seconds since the first event of the run; None: the start of the run.
    :param end_s: the end in seconds since the first event of the run; None: the end of the run.
    """

    patterns: tuple[Pattern, ...] = ()
    start_s: float | None = None
    end_s: float | None = None

    def replays(self, uid: str) -> bool:
        """Return whether the writes of an interface are replayed."""
        return not self.patterns or any(pattern.matches(parse_uid(uid)) for pattern in self.patterns)


class ReplayedWrite(NamedTuple):
    """A write to repeat.

    :param position_us: the position in microseconds since the first event of the run.
    """

    position_us: int
    event: InterfaceWrite


@dataclass(slots=True)
class ReplaySurvey:
    """The number of writes of a replay, and the first of each interface.

    :ivar write_counts: the number of writes by ``Type::id``.
    :ivar first_writes: the first write by ``Type::id``.
    :ivar unselected_write_count: the number of writes of the run if none is selected, otherwise 0.
    """

    write_counts: dict[str, int] = field(default_factory=dict)
    first_writes: dict[str, InterfaceWrite] = field(default_factory=dict)
    unselected_write_count: int = 0


def survey_replay(run: Run, selection: ReplaySelection) -> ReplaySurvey:
    """Read a run and count the writes to repeat.

    :raises TraceError: if the run cannot be read.
    """
    survey = ReplaySurvey()
    for _, event in replayed_writes(run, selection):
        survey.write_counts[event.uid] = survey.write_counts.get(event.uid, 0) + 1
        survey.first_writes.setdefault(event.uid, event)
    if not survey.write_counts:
        survey.unselected_write_count = sum(isinstance(event, InterfaceWrite) for event in run)
    return survey


def replayed_writes(run: Run, selection: ReplaySelection) -> Iterator[ReplayedWrite]:
    """Yield the writes in the order of the file.

    The last write of each interface before the start comes first.

    :raises TraceError: if the run cannot be read.
    """
    start_us = round((selection.start_s or 0.0) * MICROSECONDS)
    end_us = None if selection.end_s is None else round(selection.end_s * MICROSECONDS)
    start_values: dict[str, InterfaceWrite] = {}
    last_stamps_us: dict[str, int] = {}
    clock = MonotonicClock()
    for event in run:
        if clock.start_us is None:
            clock.advance_to(event.time_us)
        if not isinstance(event, InterfaceWrite) or not selection.replays(event.uid):
            continue
        # without a new time stamp, the time of a write is unknown
        if last_stamps_us.get(event.uid) != event.time_us:
            last_stamps_us[event.uid] = event.time_us
            clock.advance_to(event.time_us)
        if end_us is not None and clock.now_us > end_us:
            break
        if clock.now_us < start_us:
            start_values[event.uid] = event
            continue
        yield from (ReplayedWrite(start_us, write) for write in start_values.values())
        start_values.clear()
        yield ReplayedWrite(clock.now_us, event)
    yield from (ReplayedWrite(start_us, write) for write in start_values.values())
