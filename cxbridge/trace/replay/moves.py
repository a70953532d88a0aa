"""Plans a replay: what of a recorded run is played, and when; docs/recording.md, section "Time"."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.patterns import Pattern
from cxbridge.clock import MICROSECONDS
from cxbridge.events import InterfaceMessage, InterfaceWrite
from cxbridge.trace.formats.base import Run

OUT_OF_ORDER_US: Final = MICROSECONDS
"""How far a time may lie before an earlier one; more is a clock that was set."""


@dataclass(frozen=True, slots=True)
class ReplaySelection:
    """The selection of a replay.

    :param patterns: which interfaces; none: all.
    :param start_s: seconds since the first event of the run; None: from the start.
    :param end_s: the same; None: to the end.
    :param messages: whether messages to other interfaces are sent, too.
    """

    patterns: tuple[Pattern, ...] = ()
    start_s: float | None = None
    end_s: float | None = None
    messages: bool = False

    def has(self, uid: str) -> bool:
        """Whether an interface is to be replayed."""
        return not self.patterns or any(pattern.matches(parse_uid(uid)) for pattern in self.patterns)


class ReplayMove(NamedTuple):
    """One thing to do.

    :param at_us: when, microseconds since the first event of the run.
    """

    at_us: int
    event: InterfaceWrite | InterfaceMessage


class ReplayPositions:
    """From recorded times to a time that does not go back by more than :data:`OUT_OF_ORDER_US`.

    :param start_us: what positions count from.
    """

    def __init__(self, start_us: int) -> None:
        self._high_us = start_us
        self._offset_us = -start_us
        self._stamps: dict[str, int] = {}

    def of(self, event: InterfaceWrite | InterfaceMessage) -> int:
        """Return where an event is: the next one of the run."""
        time_us = event.time_us
        if isinstance(event, InterfaceWrite):
            if self._stamps.get(event.uid) == time_us:
                # it was written again with its old stamp, which does not show when
                return self._high_us + self._offset_us
            self._stamps[event.uid] = time_us
        if time_us < self._high_us - OUT_OF_ORDER_US:
            self._offset_us += self._high_us - time_us
            self._high_us = time_us
        self._high_us = max(self._high_us, time_us)
        return time_us + self._offset_us


@dataclass(slots=True)
class Survey:
    """The moves of a recording.

    :ivar writes: how many of each interface, by ``Type::id``.
    :ivar messages: how many to each other interface.
    :ivar samples: the first write of each interface.
    :ivar first_us: where the first move is; ``last_us``: the last.
    :ivar others: the number of writes of unselected interfaces.
    """

    writes: dict[str, int] = field(default_factory=dict)
    messages: dict[str, int] = field(default_factory=dict)
    samples: dict[str, InterfaceWrite] = field(default_factory=dict)
    first_us: int = 0
    last_us: int = 0
    others: int = 0


def survey(run: Run, selection: ReplaySelection) -> Survey:
    """Read a run, and return its moves.

    :raises TraceError: when it cannot be read.
    """
    found = Survey()
    for number, (at_us, event) in enumerate(moves(run, selection)):
        if not number:
            found.first_us = at_us
        found.last_us = max(found.last_us, at_us)
        if isinstance(event, InterfaceWrite):
            found.writes[event.uid] = found.writes.get(event.uid, 0) + 1
            found.samples.setdefault(event.uid, event)
        else:
            found.messages[event.uid] = found.messages.get(event.uid, 0) + 1
    if not found.writes:
        found.others = sum(isinstance(event, InterfaceWrite) for event in run)
    return found


def moves(run: Run, selection: ReplaySelection) -> Iterator[ReplayMove]:
    """Yield the moves, in the order of the file; first, the values of the interfaces at the start.

    :raises TraceError: when the run cannot be read.
    """
    start_us = round((selection.start_s or 0.0) * MICROSECONDS)
    end_us = None if selection.end_s is None else round(selection.end_s * MICROSECONDS)
    held: dict[str, InterfaceWrite] = {}
    positions: ReplayPositions | None = None
    began = False
    for event in run:
        if positions is None:
            positions = ReplayPositions(event.time_us)
        if not isinstance(event, (InterfaceWrite, InterfaceMessage)):
            continue
        write = isinstance(event, InterfaceWrite)
        if selection.has(event.uid) != write or not (write or selection.messages):
            continue
        at_us = positions.of(event)
        if end_us is not None and at_us > end_us:
            continue  # later events may be out of order, and still belong to it
        if selection.start_s is not None and at_us < start_us and not began:
            if isinstance(event, InterfaceWrite):
                held[event.uid] = event
            continue
        if not began:
            began = True
            yield from (ReplayMove(start_us, last) for last in held.values())
        yield ReplayMove(at_us, event)
    if not began:
        yield from (ReplayMove(start_us, last) for last in held.values())
