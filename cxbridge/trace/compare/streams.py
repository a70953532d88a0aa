"""Partial order of interface writes and skill statuses: the states of each interface or skiller."""

from __future__ import annotations

from collections.abc import Iterator

from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.leftovers import Leftovers
from cxbridge.trace.compare.naming import anonymous, anonymous_fact, interface_text
from cxbridge.trace.compare.result import Comparison, Order
from cxbridge.trace.compare.steps import Differing, State, StepPair, Steps
from cxbridge.trace.compare.words import judge, skill_scope
from cxbridge.trace.formats.base import Run


def compare_streams(a: Run, b: Run, view: View, tolerance: Tolerance | None = None) -> Comparison:
    """Compare, for each interface or skiller, the sequence of its values; repetitions do not count."""
    streams_a, streams_b = _read(a, view), _read(b, view)
    comparison = Comparison(view, Order.PARTIAL, streams_a.count, streams_b.count)
    differing = Differing((streams_a.start_us, streams_b.start_us), tolerance)
    for pair in streams_a.pairs(streams_b):
        differing.compare(pair)
    differing.finish(comparison)
    comparison.hints += judge(streams_a.scopes, streams_b.scopes)
    return comparison


def _read(run: Run, view: View) -> Streams:
    """Return the streams of a run."""
    streams = Streams()
    types = frozenset(view.event_types)
    for event in run:
        if type(event) in types:
            streams.add(event, streams.count)
            streams.count += 1
    return streams


class Streams:
    """The sequences of values of interfaces or of statuses of skillers, without repetitions."""

    def __init__(self) -> None:
        self.scopes: set[str] = set()
        self.count = 0
        self.start_us = 0
        self._streams: dict[str, Steps] = {}
        self._leftovers = Leftovers()
        self._states: dict[State, State] = {}

    def add(self, event: Event, position: int) -> None:
        """Take the next event of the run; one that only says again what was said last does not count."""
        if not position:
            self.start_us = event.time_us
        if isinstance(event, InterfaceWrite):
            name, text = event.uid, anonymous_fact(interface_text(event.values))
            self.scopes.add(f"interface {name}")
        elif isinstance(event, SkillStatus):
            counts = self._leftovers.fresh(event)
            if counts is None:
                return
            self.scopes.add(skill_scope(counts.skill_string))
            name = f"skiller {event.skiller} of {event.env}"
            text = anonymous(f'skill="{counts.skill_string}" status={counts.status}')
        else:
            return
        stream = self._streams.setdefault(name, Steps())
        state = self._states.setdefault((text,), (text,))
        if not stream.states or stream.states[-1] != state:
            stream.append(state, position, event.time_us)

    def pairs(self, other: Streams) -> Iterator[StepPair]:
        """Yield the streams of both runs, those of the same interface or skiller together."""
        for name in {**self._streams, **other._streams}:
            ours, theirs = self._streams.get(name, Steps()), other._streams.get(name, Steps())
            yield StepPair(name, "state", ours, theirs, ours.states, theirs.states)
