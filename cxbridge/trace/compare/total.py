"""Total order: every event must have its like at the same place in the other run."""

from __future__ import annotations

from collections import deque
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.trace.compare.checks import MessageIds, Times, Tolerance, stream_of
from cxbridge.trace.compare.divergence import Divergence
from cxbridge.trace.compare.fetch import EventReader
from cxbridge.trace.compare.naming import describe
from cxbridge.trace.compare.result import MAX_DIFFERENCES, Comparison, Difference, Kind, Order, Row, Side
from cxbridge.trace.compare.select import Selection
from cxbridge.trace.compare.tail import Tails
from cxbridge.trace.compare.tokens import Token, Tokens
from cxbridge.trace.compare.trail import Context
from cxbridge.trace.compare.words import subject_of, time_words
from cxbridge.trace.formats.base import Run

WINDOW: Final = 2000
"""So many events before the first difference are aligned again: of equal goals that were new there, what they
do later tells which is which."""


def compare_total(
    a: Run, b: Run, view: View, selection: Selection | None = None, tolerance: Tolerance | None = None
) -> Comparison:
    """Compare two runs event by event, names by first appearance, up to the first place where they differ.

    Memory does not grow with runs that are the same. From that place on they are aligned, so that what comes
    again in both does not count as different.
    """
    return _Total(a, b, view, selection, tolerance).compare()


class _Total:
    """One comparison."""

    def __init__(
        self, a: Run, b: Run, view: View, selection: Selection | None, tolerance: Tolerance | None
    ) -> None:
        self._runs = (a, b)
        self._view = view
        self._selection = selection
        self._ours, self._theirs = Tokens(a, view, selection), Tokens(b, view, selection)
        self._msgids = MessageIds()
        self._times = Times(tolerance) if tolerance else None
        self._differences: list[Difference] = []
        self._contexts: tuple[Context, Context] | None = None
        self._diverged: tuple[int | None, int | None] = (None, None)

    def compare(self) -> Comparison:
        """Read both runs, and return the outcome."""
        divergence = self._read()
        comparison = Comparison(self._view, Order.TOTAL, self._ours.count, self._theirs.count)
        if divergence is not None:
            self._tell(divergence, comparison)
        comparison.differences = self._differences[:MAX_DIFFERENCES]
        comparison.dropped += len(self._differences) - len(comparison.differences)
        comparison.contexts = self._contexts
        if self._contexts and not comparison.rows:
            lines = zip(self._contexts[0].lines, self._contexts[1].lines, strict=False)
            comparison.rows = [Row(one, other, not one.here) for one, other in lines]
        return comparison

    def _read(self) -> Divergence | None:
        """Read both runs side by side; return their rests when they differ."""
        ours, theirs = iter(self._ours), iter(self._theirs)
        window: deque[tuple[Token, Token, int]] = deque(maxlen=WINDOW)
        while True:
            known = len(self._ours.namer)
            one, other = next(ours, None), next(theirs, None)
            if one is None and other is None:
                return None
            if one is None or other is None or one.key != other.key or one.names != other.names:
                break
            window.append((one, other, known))
            if one.msgid is not None or other.msgid is not None:
                self._check_msgid(one, other)
            if self._times:
                self._check_time(one, other, self._times)
        last = window[-1] if window else None
        self._diverged = _number(one, last and last[0]), _number(other, last and last[1])
        self._keep_contexts(*self._diverged)
        tails = Tails(window[0][2] if window else known)
        for pair in window:
            tails.add(pair[0], pair[1])
        while one is not None or other is not None:
            tails.add(one, other)
            one, other = next(ours, None), next(theirs, None)
        return Divergence(tails, len(window))

    def _keep_contexts(self, at_a: int | None, at_b: int | None) -> None:
        """Keep what led to the first difference."""
        if self._contexts is None:
            self._contexts = (self._ours.trail.context(at_a), self._theirs.trail.context(at_b))

    def _check_msgid(self, one: Token, other: Token) -> None:
        """Note a difference when the ids of messages do not go on alike."""
        stream = stream_of(one.key, one.thread)
        if self._msgids.differ(stream, one.msgid or 0, other.msgid or 0):
            self._note(one, other, Kind.MSGID, "another message id")

    def _check_time(self, one: Token, other: Token, times: Times) -> None:
        """Note a difference when partners did not come at the same time."""
        late = times.lag((one.thread, one.own_names), one.event.time_us, other.event.time_us)
        if late is not None:
            self._note(one, other, Kind.TIME, time_words(late))

    def _note(self, one: Token, other: Token, kind: Kind, what: str) -> None:
        """Note a difference between partners."""
        self._keep_contexts(one.number, other.number)
        ours, theirs = (Side(token.number, describe(token.event)) for token in (one, other))
        self._differences.append(Difference(what, subject_of(one.event), ours, theirs, kind))

    def _tell(self, divergence: Divergence, comparison: Comparison) -> None:
        """Tell what became of the rests."""
        ours, theirs = self._ours, self._theirs
        first = not self._differences
        edits = divergence.edits(self._msgids, self._times)
        room = max(0, MAX_DIFFERENCES - len(self._differences))
        self._differences += divergence.differences(
            edits[:room], [EventReader(run, self._view, self._selection) for run in self._runs]
        )
        comparison.dropped = len(edits[room:])
        if first:
            comparison.rows = divergence.rows((ours.trail, theirs.trail))
            at_a, at_b = self._diverged
            if self._differences[0].a.position != at_a and self._differences[0].b.position != at_b:
                self._contexts = None  # something before is the first: it is read again
        alike = ours.count - len(divergence.tails.a) + divergence.partner_count
        comparison.alike = alike / max(ours.count, theirs.count, 1)
        comparison.hints = divergence.hints(edits, comparison.alike)


def _number(token: Token | None, last: Token | None) -> int | None:
    """Return the number of an event, or of the last one when the run is over."""
    token = token or last
    return None if token is None else token.number
