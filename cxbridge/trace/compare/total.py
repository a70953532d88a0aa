"""Compares in total order: every event must have its like at the same place in the other run."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterable, Iterator, Sequence
from itertools import islice
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.events import Event
from cxbridge.trace.compare.align import NONE
from cxbridge.trace.compare.checks import MessageIds, PartnerTimes, Tolerance, stream_of, time_words
from cxbridge.trace.compare.context import LINES_BEFORE, ContextTracker
from cxbridge.trace.compare.edits import Edit, Edits, RunTail, RunTails
from cxbridge.trace.compare.keys import (
    DIFFERENT_SCENARIOS,
    Token,
    Tokens,
    changed_parts,
    detail_change,
    different_scenarios,
    scope_of,
    subject_of,
)
from cxbridge.trace.compare.model import (
    MAX_DIFFERENCES,
    AlignedRow,
    Comparison,
    Difference,
    DifferenceContext,
    DifferenceKind,
    EventLine,
    Order,
    Side,
)
from cxbridge.trace.compare.selection import Selection, compared
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe, describe_details

ROWS_AFTER = 16
"""So many rows are shown from the first difference on."""

FEW_ORDER = 1
"""With at least so many differences, all of order, the report names partial order."""

NOTHING = "(nothing here)"
OVER = "(the run is over)"

WINDOW: Final = 2000
"""So many events before the first difference are aligned again: of equal goals that were new there, what they
do later says which is which."""


def compare_total(
    a: Run, b: Run, view: View, selection: Selection | None = None, tolerance: Tolerance | None = None
) -> Comparison:
    """Compare two runs event by event, names by first appearance, up to the first place where they differ.

    Memory does not grow with runs that are the same. From that place on they are aligned, so that what comes
    again in both does not count as different.
    """
    return _TotalComparison(a, b, view, selection, tolerance).compare()


class _TotalComparison:
    """One comparison."""

    def __init__(
        self, a: Run, b: Run, view: View, selection: Selection | None, tolerance: Tolerance | None
    ) -> None:
        self._runs = (a, b)
        self._view = view
        self._selection = selection
        self._ours, self._theirs = Tokens(a, view, selection), Tokens(b, view, selection)
        self._msgids = MessageIds()
        self._times = PartnerTimes(tolerance) if tolerance else None
        self._differences: list[Difference] = []
        self._contexts: tuple[DifferenceContext, DifferenceContext] | None = None
        self._diverged: tuple[int | None, int | None] = (None, None)

    def compare(self) -> Comparison:
        """Read both runs, and return the outcome."""
        divergence = self._read()
        comparison = Comparison(self._view, Order.TOTAL, self._ours.count, self._theirs.count)
        if divergence is not None:
            self._report(divergence, comparison)
        comparison.keep(self._differences)
        comparison.contexts = self._contexts
        if self._contexts and not comparison.rows:
            lines = zip(self._contexts[0].lines, self._contexts[1].lines, strict=False)
            comparison.rows = [AlignedRow(one, other, not one.here) for one, other in lines]
        return comparison

    def _read(self) -> TailDivergence | None:
        """Read both runs side by side; return their tails when they differ."""
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
        tails = RunTails(window[0][2] if window else known)
        for pair in window:
            tails.add(pair[0], pair[1])
        while one is not None or other is not None:
            tails.add(one, other)
            one, other = next(ours, None), next(theirs, None)
        return TailDivergence(tails, len(window))

    def _keep_contexts(self, at_a: int | None, at_b: int | None) -> None:
        """Keep what led to the first difference."""
        if self._contexts is None:
            self._contexts = (self._ours.context.context(at_a), self._theirs.context.context(at_b))

    def _check_msgid(self, one: Token, other: Token) -> None:
        """Note a difference when the ids of messages do not go on alike."""
        if self._msgids.differ(stream_of(one.key), one.msgid or 0, other.msgid or 0):
            self._note(one, other, DifferenceKind.MSGID, "another message id")

    def _check_time(self, one: Token, other: Token, times: PartnerTimes) -> None:
        """Note a difference when partners did not come at the same time."""
        late = times.lag(one.thread, one.event.time_us, other.event.time_us)
        if late is not None:
            self._note(one, other, DifferenceKind.TIME, time_words(late))

    def _note(self, one: Token, other: Token, kind: DifferenceKind, what: str) -> None:
        """Note a difference between partners."""
        self._keep_contexts(one.number, other.number)
        ours, theirs = (Side(token.number, describe(token.event)) for token in (one, other))
        self._differences.append(Difference(what, subject_of(one.event), ours, theirs, kind))

    def _report(self, divergence: TailDivergence, comparison: Comparison) -> None:
        """Put what became of the tails into a comparison."""
        ours, theirs = self._ours, self._theirs
        first = not self._differences
        edits = divergence.edits(self._msgids, self._times)
        room = max(0, MAX_DIFFERENCES - len(self._differences))
        reread = [compared(run, self._view, self._selection) for run in self._runs]
        self._differences += divergence.differences(edits[:room], reread)
        comparison.dropped = len(edits[room:])
        if first:
            comparison.rows = divergence.rows((ours.context, theirs.context))
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


class TailDivergence:
    """The tails of two runs.

    :param same: so many events at their begin are the same: the last ones before the first difference.
    """

    def __init__(self, tails: RunTails, same: int) -> None:
        self.tails = tails
        self._tails = (tails.a, tails.b)
        self._same = same
        self._partners = tails.align()
        self._edits = Edits(tails, self._partners)

    @property
    def partner_count(self) -> int:
        """How many events of the tails have a partner at the same place."""
        return sum(1 for partner in self._partners if partner != NONE)

    def edits(self, msgids: MessageIds, times: PartnerTimes | None) -> list[Edit]:
        """Return all differences between the tails, in the order of the runs."""
        found = list(self._edits)
        found += self._checked(msgids, times)
        found.sort(key=lambda edit: edit.place)
        return list(self._without_repeated_details(found))

    def _without_repeated_details(self, edits: Iterable[Edit]) -> Iterator[Edit]:
        """Yield edits; a parameter that differs in all events of a goal or plan-action is one of them."""
        seen: set[Hashable] = set()
        for edit in edits:
            change = self._detail_change(edit)
            if change is None or change not in seen:
                seen.add(change)
                yield edit

    def _checked(self, msgids: MessageIds, times: PartnerTimes | None) -> Iterator[Edit]:
        """Yield the differences between partners: ids of messages, and times."""
        a, b = self._tails
        tails, next_b = self.tails, 0
        for at, partner in enumerate(self._partners):
            if partner == NONE:
                self._gap(a, at, msgids)
                continue
            for other in range(next_b, partner):
                self._gap(b, other, msgids)
            next_b = partner + 1
            if at == partner < self._same:
                continue  # it was looked at when it was read
            if a.msgids[at] != NONE and msgids.differ(self._stream(a, at), a.msgids[at], b.msgids[partner]):
                yield Edit(DifferenceKind.MSGID, at, partner, (at, 0, at))
            if times:
                late = times.lag(tails.thread(a, at), a.times[at], b.times[partner])
                if late is not None:
                    yield Edit(DifferenceKind.TIME, at, partner, (at, 0, at), late=late)

    def _gap(self, tail: RunTail, at: int, msgids: MessageIds) -> None:
        """Note an event without a partner."""
        if tail.msgids[at] != NONE:
            msgids.gap(self._stream(tail, at))

    def _stream(self, tail: RunTail, at: int) -> Hashable:
        """Return what the ids of messages are counted by."""
        return stream_of(self.tails.key(tail, at))

    def differences(self, edits: Sequence[Edit], reread: Sequence[Iterable[Event]]) -> list[Difference]:
        """Return edits in words.

        :param reread: the events of both runs that are compared: those that were not kept are read again.
        """
        events = [
            self._events(tail, {edit.at[run] for edit in edits if edit.at[run] != NONE}, reread[run])
            for run, tail in enumerate(self._tails)
        ]
        found = []
        for edit in edits:
            shown = [events[run].get(edit.at[run]) for run in (0, 1)]
            subject = next(event for event in shown if event is not None)
            one, other = (self._side(run, edit, event) for run, event in enumerate(shown))
            found.append(
                Difference(
                    self._what(edit), subject_of(subject), one, other, kind=edit.kind, count=edit.count
                )
            )
        return found

    def _events(self, tail: RunTail, wanted: set[int], reread: Iterable[Event]) -> dict[int, Event]:
        """Return events of a tail by their indices."""
        found = {at: tail.events[at] for at in wanted if at < len(tail.events)}
        missing = {tail.numbers[at]: at for at in wanted if at >= len(tail.events)}
        if missing:
            upto = islice(reread, max(missing) + 1)
            found |= {missing[number]: event for number, event in enumerate(upto) if number in missing}
        return found

    def _side(self, run: int, edit: Edit, event: Event | None) -> Side:
        """Return what one run has."""
        if event is not None:
            text = describe(event)
            if self._detail_change(edit):
                text = f"{text} {describe_details(event)}"
            return Side(self._tails[run].numbers[edit.at[run]], text)
        before = self._edits.partner_before(1 - run, edit.at[1 - run])
        number = None if before == NONE else self._tails[run].numbers[before]
        return Side(number, OVER if self._ends(run, edit) else NOTHING)

    def _detail_change(self, edit: Edit) -> Hashable:
        """Return how partners differ when they do in details only, which their texts do not show."""
        if edit.kind is not DifferenceKind.CHANGED:
            return None
        (a, b), (at, other), tails = self._tails, edit.at, self.tails
        return detail_change(
            tails.key(a, at), tails.labels(a, at), tails.key(b, other), tails.labels(b, other)
        )

    def _ends(self, run: int, edit: Edit) -> bool:
        """Whether a run that has nothing at an edit is over there, and the other one goes on to its end."""
        other = 1 - run
        if edit.whole or edit.at[other] + edit.count < len(self._tails[other]):
            return False
        return self._edits.partner_before(other, edit.at[other]) + 1 == len(self._tails[run])

    def _what(self, edit: Edit) -> str:
        """Return in words what differs."""
        if edit.kind is DifferenceKind.MSGID:
            return "another message id"
        if edit.kind is DifferenceKind.TIME:
            return time_words(edit.late)
        if edit.kind is DifferenceKind.CHANGED:
            (a, b), (at, other), tails = self._tails, edit.at, self.tails
            return changed_parts(
                tails.key(a, at), tails.labels(a, at), tails.key(b, other), tails.labels(b, other)
            )
        events = "an event" if edit.count == 1 else f"{edit.count} events"
        if edit.kind is DifferenceKind.ORDER:
            later = edit.place[:2] == (edit.at[0], 0)
            return f"{events} in another order: {'later' if later else 'earlier'} in B"
        return self._only(edit, events)

    def _only(self, edit: Edit, events: str) -> str:
        """Return in words what one run has alone."""
        name, missing, other = ("A", 1, "B") if edit.kind is DifferenceKind.ONLY_A else ("B", 0, "A")
        if edit.whole:
            return f"a goal that only {name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._ends(missing, edit):
            return f"{other} ends here, {name} goes on"
        return f"{events} that only {name} has"

    def rows(self, contexts: Sequence[ContextTracker]) -> list[AlignedRow]:
        """Return both runs next to each other around the first place where they differ."""
        first = next((i for i, partner in enumerate(self._partners) if partner != i), len(self._partners))
        rows: list[AlignedRow] = []
        at = [max(0, first - LINES_BEFORE)] * 2
        end = first - at[0] + ROWS_AFTER
        shown_first = False
        while len(rows) < end:
            chosen = self._next_row(*at)
            same = NONE not in chosen and self._partners[chosen[0]] == chosen[1]
            lines = [
                self._line(run, chosen[run], contexts[run], here=not (same or shown_first)) for run in (0, 1)
            ]
            if lines == [None, None]:
                break
            shown_first = shown_first or not same
            rows.append(AlignedRow(lines[0], lines[1], same))
            at = [index + (one != NONE) for index, one in zip(at, chosen, strict=True)]
        return rows

    def _next_row(self, at_a: int, at_b: int) -> tuple[int, int]:
        """Return which events come next to each other after these indices, -1 for a gap."""
        if at_a >= len(self._tails[0]):
            return NONE, at_b
        if at_b >= len(self._tails[1]):
            return at_a, NONE
        partner = self._partners[at_a]
        changed = self._edits.changed.get(at_a, NONE)
        if at_b in {partner, changed}:
            return at_a, at_b
        waits = partner != NONE or (changed > at_b and not self._edits.has_partner(at_b))
        return (NONE, at_b) if waits else (at_a, NONE)

    def _line(self, run: int, at: int, context: ContextTracker, *, here: bool) -> EventLine | None:
        """Return an event of a tail as a line, None when there is none or it was not kept."""
        tail = self._tails[run]
        if at == NONE or at >= len(tail.events):
            return None
        return context.line(tail.numbers[at], tail.events[at], here=here)

    def hints(self, edits: Sequence[Edit], alike: float) -> list[str]:
        """Return what a person should know about the differences beside them."""
        if alike < DIFFERENT_SCENARIOS:
            scopes = [{scope_of(self.tails.keys.all[key]) for key in set(tail.keys)} for tail in self._tails]
            return [different_scenarios(*scopes)]
        if len(edits) >= FEW_ORDER and all(edit.kind is DifferenceKind.ORDER for edit in edits):
            return ["only the order differs: compare with --order partial if the order is no matter"]
        return []
