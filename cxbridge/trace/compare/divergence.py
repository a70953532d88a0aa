"""What a report says of two runs from the first place on at which they differ in total order."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence

from cxbridge.events import Event
from cxbridge.trace.compare.align import NONE
from cxbridge.trace.compare.checks import MessageIds, Times, stream_of
from cxbridge.trace.compare.edits import Edit, Edits
from cxbridge.trace.compare.fetch import EventReader
from cxbridge.trace.compare.naming import describe
from cxbridge.trace.compare.result import Difference, Kind, Row, Side
from cxbridge.trace.compare.tail import Tail, Tails
from cxbridge.trace.compare.trail import LINES_BEFORE, Line, Trail
from cxbridge.trace.compare.words import (
    STRANGERS,
    changed,
    scope_of,
    strangers,
    subject_of,
    time_words,
)

ROWS_AFTER = 16
"""So many rows are shown from the first difference on."""

FEW_ORDER = 1
"""With at least so many differences, all of order, a person should hear of partial order."""

NOTHING = "(nothing here)"
OVER = "(the run is over)"


class Divergence:
    """The rests of two runs.

    :param same: so many events at their begin are the same: the last ones before the first difference.
    """

    def __init__(self, tails: Tails, same: int) -> None:
        self.tails = tails
        self._rests = (tails.a, tails.b)
        self._same = same
        self._partners = tails.align()
        self._edits = Edits(tails, self._partners)

    @property
    def partner_count(self) -> int:
        """How many events of the rests have a partner at the same place."""
        return sum(1 for partner in self._partners if partner != NONE)

    def edits(self, msgids: MessageIds, times: Times | None) -> list[Edit]:
        """Return all differences between the rests, in the order of the runs."""
        found = list(self._edits)
        found += self._checked(msgids, times)
        found.sort(key=lambda edit: edit.place)
        return found

    def _checked(self, msgids: MessageIds, times: Times | None) -> Iterator[Edit]:
        """Yield the differences between partners: ids of messages, and times."""
        a, b = self._rests
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
                yield Edit(Kind.MSGID, at, partner, (at, 0, at))
            if times:
                late = times.lag(tails.thread(a, at), a.times[at], b.times[partner])
                if late is not None:
                    yield Edit(Kind.TIME, at, partner, (at, 0, at), late=late)

    def _gap(self, tail: Tail, at: int, msgids: MessageIds) -> None:
        """Note an event without a partner."""
        if tail.msgids[at] != NONE:
            msgids.gap(self._stream(tail, at))

    def _stream(self, tail: Tail, at: int) -> Hashable:
        """Return what the ids of messages are counted by."""
        return stream_of(self.tails.keys.all[tail.keys[at]], self.tails.thread(tail, at)[0])

    def differences(self, edits: Sequence[Edit], readers: Sequence[EventReader]) -> list[Difference]:
        """Return edits in words; events that were not kept are read again."""
        events = [
            self._events(tail, {edit.at[run] for edit in edits if edit.at[run] != NONE}, readers[run])
            for run, tail in enumerate(self._rests)
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

    def _events(self, tail: Tail, wanted: set[int], reader: EventReader) -> dict[int, Event]:
        """Return events of a rest by their indices."""
        found = {at: tail.events[at] for at in wanted if at < len(tail.events)}
        again = {tail.numbers[at]: at for at in wanted if at >= len(tail.events)}
        return found | {again[number]: event for number, event in reader.events(again).items()}

    def _side(self, run: int, edit: Edit, event: Event | None) -> Side:
        """Return what one run has."""
        if event is not None:
            return Side(self._rests[run].numbers[edit.at[run]], describe(event))
        before = self._edits.partner_before(1 - run, edit.at[1 - run])
        number = None if before == NONE else self._rests[run].numbers[before]
        return Side(number, OVER if self._ends(run, edit) else NOTHING)

    def _ends(self, run: int, edit: Edit) -> bool:
        """Whether a run that has nothing at an edit is over there, and the other one goes on to its end."""
        other = 1 - run
        if edit.whole or edit.at[other] + edit.count < len(self._rests[other]):
            return False
        return self._edits.partner_before(other, edit.at[other]) + 1 == len(self._rests[run])

    def _what(self, edit: Edit) -> str:
        """Return in words what differs."""
        if edit.kind is Kind.MSGID:
            return "another message id"
        if edit.kind is Kind.TIME:
            return time_words(edit.late)
        if edit.kind is Kind.CHANGED:
            tails, sides = self.tails, list(zip(self._rests, edit.at, strict=True))
            keys = [tails.keys.all[rest.keys[at]] for rest, at in sides]
            labels = [tails.labels(rest, at) for rest, at in sides]
            return changed(keys[0], labels[0], keys[1], labels[1])
        events = "an event" if edit.count == 1 else f"{edit.count} events"
        if edit.kind is Kind.ORDER:
            later = edit.place[:2] == (edit.at[0], 0)
            return f"{events} in another order: {'later' if later else 'earlier'} in B"
        return self._only(edit, events)

    def _only(self, edit: Edit, events: str) -> str:
        """Return in words what one run has alone."""
        name, missing, other = ("A", 1, "B") if edit.kind is Kind.ONLY_A else ("B", 0, "A")
        if edit.whole:
            return f"a goal that only {name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._ends(missing, edit):
            return f"{other} ends here, {name} goes on"
        return f"{events} that only {name} has"

    def rows(self, trails: Sequence[Trail]) -> list[Row]:
        """Return both runs next to each other around the first place where they differ."""
        first = next((i for i, partner in enumerate(self._partners) if partner != i), len(self._partners))
        rows: list[Row] = []
        at = [max(0, first - LINES_BEFORE)] * 2
        end = first - at[0] + ROWS_AFTER
        told = False
        while len(rows) < end:
            chosen = self._next_row(*at)
            same = NONE not in chosen and self._partners[chosen[0]] == chosen[1]
            lines = [self._line(run, chosen[run], trails[run], here=not (same or told)) for run in (0, 1)]
            if lines == [None, None]:
                break
            told = told or not same
            rows.append(Row(lines[0], lines[1], same))
            at = [index + (one != NONE) for index, one in zip(at, chosen, strict=True)]
        return rows

    def _next_row(self, at_a: int, at_b: int) -> tuple[int, int]:
        """Return which events come next to each other after these indices, -1 for a gap."""
        if at_a >= len(self._rests[0]):
            return NONE, at_b
        if at_b >= len(self._rests[1]):
            return at_a, NONE
        partner = self._partners[at_a]
        changed = self._edits.changed.get(at_a, NONE)
        if at_b in {partner, changed}:
            return at_a, at_b
        waits = partner != NONE or (changed > at_b and not self._edits.has_partner(at_b))
        return (NONE, at_b) if waits else (at_a, NONE)

    def _line(self, run: int, at: int, trail: Trail, *, here: bool) -> Line | None:
        """Return an event of a rest as a line, None when there is none or it was not kept."""
        rest = self._rests[run]
        if at == NONE or at >= len(rest.events):
            return None
        return trail.line(rest.numbers[at], rest.events[at], here=here)

    def hints(self, edits: Sequence[Edit], alike: float) -> list[str]:
        """Return what a person should know of the differences beside them."""
        if alike < STRANGERS:
            scopes = [{scope_of(self.tails.keys.all[key]) for key in set(rest.keys)} for rest in self._rests]
            return [strangers(*scopes)]
        if len(edits) >= FEW_ORDER and all(edit.kind is Kind.ORDER for edit in edits):
            return ["only the order differs: compare with --order partial if the order is no matter"]
        return []
