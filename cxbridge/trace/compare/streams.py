"""Partial order of interface writes and skill statuses: the states of each interface or skiller."""

from __future__ import annotations

from typing import NamedTuple

from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.trace.compare.leftovers import Leftovers
from cxbridge.trace.compare.naming import anonymous, anonymous_fact, interface_text
from cxbridge.trace.compare.result import Comparison, Difference, Order, Side
from cxbridge.trace.formats.base import Run
from cxbridge.trace.levels import View


class _State(NamedTuple):
    """What counts of one event, and its number among those of the view."""

    text: str
    position: int


def compare_streams(a: Run, b: Run, view: View) -> Comparison:
    """Compare, for each interface or skiller, the sequence of its values; repetitions do not count."""
    (streams_a, count_a), (streams_b, count_b) = _read(a, view), _read(b, view)
    return Comparison(view, Order.PARTIAL, count_a, count_b, streams_a.differences(streams_b))


def _read(run: Run, view: View) -> tuple[Streams, int]:
    """Return the streams of a run, and how many events of the view it has."""
    streams, count = Streams(), 0
    for event in run:
        if isinstance(event, view.event_types):
            streams.add(event, count)
            count += 1
    return streams, count


class Streams:
    """The sequences of values of interfaces or of statuses of skillers, without repetitions."""

    def __init__(self) -> None:
        self._streams: dict[str, list[_State]] = {}
        self._leftovers = Leftovers()

    def add(self, event: Event, position: int) -> None:
        """Take the next event of the run; one that only says again what was said last does not count."""
        if isinstance(event, InterfaceWrite):
            name, text = event.uid, anonymous_fact(interface_text(event, with_msgid=False))
        elif isinstance(event, SkillStatus):
            counts = self._leftovers.fresh(event)
            if counts is None:
                return
            name = f"skiller {event.skiller} of {event.env}"
            text = anonymous(f'skill="{counts.skill_string}" status={counts.status}')
        else:
            return
        stream = self._streams.setdefault(name, [])
        if not stream or stream[-1].text != text:
            stream.append(_State(text, position))

    def differences(self, other: Streams) -> list[Difference]:
        """Return the first difference in each stream."""
        found = []
        for name in {**self._streams, **other._streams}:
            ours, theirs = self._streams.get(name, []), other._streams.get(name, [])
            at = _first_difference(ours, theirs)
            if at is not None:
                found.append(
                    Difference(
                        what=f"its state number {at + 1}",
                        subject=name,
                        a=_side(ours, at),
                        b=_side(theirs, at),
                    )
                )
        return sorted(found, key=lambda difference: difference.position)


def _first_difference(ours: list[_State], theirs: list[_State]) -> int | None:
    """Return the index at which two streams differ, None when they are the same."""
    for at, (one, other) in enumerate(zip(ours, theirs, strict=False)):
        if one.text != other.text:
            return at
    return None if len(ours) == len(theirs) else min(len(ours), len(theirs))


def _side(stream: list[_State], at: int) -> Side:
    """Return what one run has at this place of a stream."""
    if at < len(stream):
        return Side(stream[at].position, stream[at].text)
    return Side(stream[-1].position, "(nothing more)") if stream else Side(None, "(nothing)")
