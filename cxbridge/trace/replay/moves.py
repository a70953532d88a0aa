"""The moves of a replay: the writes to repeat, each with its position in the recording.

The clock of a recorded machine may have been set, and writes may be out of order. Positions therefore count
from the first event, and decrease only for writes out of order; see docs/recording.md, section "Time".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.patterns import Pattern
from cxbridge.clock import MICROSECONDS
from cxbridge.events import InterfaceWrite
from cxbridge.trace.formats.base import Run

MAX_OUT_OF_ORDER_US: Final = MICROSECONDS
"""The maximum step back in time of a write out of order; a larger step means that the clock was set."""


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


class ReplayMove(NamedTuple):
    """A write to repeat.

    :param at_us: the position in microseconds since the first event of the run.
    """

    at_us: int
    event: InterfaceWrite


class ReplayPositions:
    """Converts recorded times to positions that decrease by at most :data:`MAX_OUT_OF_ORDER_US`."""

    def __init__(self, start_us: int) -> None:
        self._latest_us = start_us
        self._offset_us = -start_us
        self._last_stamps_us: dict[str, int] = {}

    def find_position_us(self, event: InterfaceWrite) -> int:
        """Return the position of the next event of the run."""
        time_us = event.time_us
        if self._last_stamps_us.get(event.uid) == time_us:
            # without a new time stamp, the time of a write is unknown
            return self._latest_us + self._offset_us
        self._last_stamps_us[event.uid] = time_us
        # the clock was set back: positions continue from the latest position
        if time_us < self._latest_us - MAX_OUT_OF_ORDER_US:
            self._offset_us += self._latest_us - time_us
            self._latest_us = time_us
        self._latest_us = max(self._latest_us, time_us)
        return time_us + self._offset_us


@dataclass(slots=True)
class ReplaySurvey:
    """The number of writes of a replay, and the first of each interface.

    :ivar write_counts: the number of writes by ``Type::id``.
    :ivar samples: the first write by ``Type::id``.
    :ivar unselected_writes: the number of writes of unselected interfaces.
    """

    write_counts: dict[str, int] = field(default_factory=dict)
    samples: dict[str, InterfaceWrite] = field(default_factory=dict)
    unselected_writes: int = 0


def survey_replay(run: Run, selection: ReplaySelection) -> ReplaySurvey:
    """Read a run and count its moves.

    :raises TraceError: if the run cannot be read.
    """
    survey = ReplaySurvey()
    for _, event in replay_moves(run, selection):
        survey.write_counts[event.uid] = survey.write_counts.get(event.uid, 0) + 1
        survey.samples.setdefault(event.uid, event)
    if not survey.write_counts:
        survey.unselected_writes = sum(isinstance(event, InterfaceWrite) for event in run)
    return survey


def replay_moves(run: Run, selection: ReplaySelection) -> Iterator[ReplayMove]:
    """Yield the moves in the order of the file, preceded by the values of the interfaces at the start.

    :raises TraceError: if the run cannot be read.
    """
    start_us = round((selection.start_s or 0.0) * MICROSECONDS)
    end_us = None if selection.end_s is None else round(selection.end_s * MICROSECONDS)
    start_values: dict[str, InterfaceWrite] = {}
    positions: ReplayPositions | None = None
    has_begun = False
    for event in run:
        if positions is None:
            positions = ReplayPositions(event.time_us)
        if not isinstance(event, InterfaceWrite) or not selection.replays(event.uid):
            continue
        at_us = positions.find_position_us(event)
        if end_us is not None and at_us > end_us:
            continue  # later events may be out of order and precede the end
        if selection.start_s is not None and at_us < start_us and not has_begun:
            start_values[event.uid] = event
            continue
        if not has_begun:
            has_begun = True
            yield from (ReplayMove(start_us, write) for write in start_values.values())
        yield ReplayMove(at_us, event)
    if not has_begun:
        yield from (ReplayMove(start_us, write) for write in start_values.values())
