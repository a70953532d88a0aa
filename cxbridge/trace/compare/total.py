"""Comparison in total order: the runs must have equal events at equal positions."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Hashable, Iterable, Iterator
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.trace.compare.align import NONE
from cxbridge.trace.compare.checks import MessageIds, PartnerTimes, Tolerance, stream_of, time_words
from cxbridge.trace.compare.context import event_line
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.edits import Alignment, Edit
from cxbridge.trace.compare.keys import (
    NamedKey,
    Token,
    Tokens,
    changed_parts,
    detail_change,
    scenario_hints,
    scope_of,
    subject_of,
    thread_key,
)
from cxbridge.trace.compare.model import (
    AlignedRow,
    Comparison,
    Difference,
    DifferenceKind,
    EventLine,
    Order,
    Side,
)
from cxbridge.trace.compare.names import Names
from cxbridge.trace.compare.selection import Selection
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe, describe_details

NOTHING = "(nothing here)"
OVER = "(the run is over)"

WINDOW: Final = 2000
"""The number of events before the first difference that are aligned again.

If several equal goals are new there, only later events show which ones are partners.
"""


def compare_total(
    a: Run,
    b: Run,
    view: View,
    selection: Selection | None = None,
    tolerance: Tolerance | None = None,
    missing: MissingDetails | None = None,
) -> Comparison:
    """Compare two runs event by event up to the first difference, with names by first appearance.

    The rest is aligned, so that only events without a partner count as different. For equal runs the memory
    stays constant.

    :param missing: details that do not count.
    """
    runs = (Tokens(a, view, selection, missing), Tokens(b, view, selection, missing))
    checks = _PartnerChecks(tolerance)
    differences: list[Difference] = []
    window: deque[tuple[Token, Token, int]] = deque(maxlen=WINDOW)
    ours, theirs = iter(runs[0]), iter(runs[1])
    while True:
        known = len(runs[0].namer)
        one, other = next(ours, None), next(theirs, None)
        if one is None or other is None or one.key != other.key or one.names != other.names:
            break
        window.append((one, other, known))
        if tolerance or one.msgid is not None or other.msgid is not None:
            differences += checks.differences(one, other)
    tails = [
        [*same, *([] if token is None else [token]), *rest]
        for same, token, rest in (
            ([pair[0] for pair in window], one, ours),
            ([pair[1] for pair in window], other, theirs),
        )
    ]
    comparison = Comparison(view, Order.TOTAL, runs[0].count, runs[1].count)
    if len(window) < max(map(len, tails)):
        known = window[0][2] if window else known
        divergence = Divergence(tails, known, (runs[0].start_us, runs[1].start_us))
        first = not differences
        differences += divergence.differences(checks, len(window))
        comparison.rows = divergence.rows() if first else []
        longer = max(comparison.count_a, comparison.count_b)
        comparison.alike = (longer - divergence.unpaired) / longer
        comparison.hints = divergence.hints(differences)
    comparison.keep(differences)
    return comparison


class _PartnerChecks:
    """Finds differences between paired equal events: message ids and times."""

    def __init__(self, tolerance: Tolerance | None) -> None:
        self._msgids = MessageIds()
        self._times = PartnerTimes(tolerance) if tolerance else None

    def differences(self, one: Token, other: Token) -> Iterator[Difference]:
        """Yield the differences between the next pair."""
        if self._msgids.differ(stream_of(one.key), one.msgid or 0, other.msgid or 0):
            yield _between(one, other, DifferenceKind.MSGID, "another message id")
        if self._times:
            late = self._times.lag(one.thread, one.event.time_us, other.event.time_us)
            if late is not None:
                yield _between(one, other, DifferenceKind.TIME, time_words(late))

    def gap(self, token: Token) -> None:
        """Note an event without a partner."""
        if token.msgid is not None:
            self._msgids.gap(stream_of(token.key))


def _between(one: Token, other: Token, kind: DifferenceKind, text: str) -> Difference:
    ours, theirs = (Side(token.number, describe(token.event)) for token in (one, other))
    return Difference(text, subject_of(one.event), ours, theirs, kind)


class Divergence:
    """The rest of two runs from the first difference on, with equal names for paired goals.

    :param tails: the events of both runs.
    :param known: the number of names that are equal in both runs.
    :param start_us: the start of each run in microseconds.
    """

    def __init__(self, tails: list[list[Token]], known: int, start_us: tuple[int, int]) -> None:
        self._tails = tails
        self._known = known
        self._start_us = start_us
        self._partner: dict[int, int] = {}  # names of B to names of A
        self._taken: set[int] = set()  # names of A that have a partner
        self._alignment = Alignment(*([token.key for token in tail] for tail in tails))
        if any(token.names for tail in tails for token in tail):
            self._learn_names()
            states = [
                [self._key_and_names(run, at) for at in range(len(tail))] for run, tail in enumerate(tails)
            ]
            self._alignment = Alignment(*states)
            self._adopt_names()

    @property
    def unpaired(self) -> int:
        """The number of events of the longer rest without a partner."""
        return max(map(len, self._tails)) - len(self._alignment.pairs)

    def differences(self, checks: _PartnerChecks, same: int) -> list[Difference]:
        """Return all differences in the order of the runs.

        :param same: the number of leading pairs that were checked while reading.
        """
        edits = self._alignment.edits(self._content, self._thread, owner=self._owner)
        found = [(edit.place, self._difference(edit)) for edit in self._without_repeated_details(edits)]
        begins = [(NONE, NONE), *self._alignment.pairs]
        for (last_a, last_b), (one, other) in zip(begins, self._alignment.pairs, strict=False):
            for token in (*self._tails[0][last_a + 1 : one], *self._tails[1][last_b + 1 : other]):
                checks.gap(token)
            if not one == other < same:
                partners = self._tails[0][one], self._tails[1][other]
                found += (((one, 0, one), each) for each in checks.differences(*partners))
        return [difference for _, difference in sorted(found, key=lambda each: each[0])]

    def rows(self) -> list[AlignedRow]:
        """Return both runs side by side around the first difference."""
        return self._alignment.rows(self._line)

    def hints(self, differences: list[Difference]) -> list[str]:
        """Return hints for the user."""
        if all(difference.kind is DifferenceKind.ORDER for difference in differences):
            return ["only the order differs: compare with --order partial if the order is no matter"]
        scopes = [{scope_of(key) for key in {token.key for token in tail}} for tail in self._tails]
        return scenario_hints(*scopes)

    def _learn_names(self) -> None:
        """Pair the names of both runs by the votes of paired events; the most votes win."""
        votes = Counter(
            pair
            for one, other in self._alignment.pairs
            for pair in zip(self._tails[0][one].names, self._tails[1][other].names, strict=False)
        )
        for pair, _ in votes.most_common():
            self._adopt(*pair)

    def _adopt_names(self) -> None:
        """Pair goals that only one run has and that are in the same gap, if their kinds allow it."""
        gaps: dict[Hashable, tuple[dict[int, None], dict[int, None]]] = defaultdict(lambda: ({}, {}))
        for run in (0, 1):
            for at in self._alignment.loose(run):
                token = self._tails[run][at]
                if token.key[0] == "goal" and self._owner(run, at) is not None:
                    gaps[self._alignment.gap(run, at), thread_key(token.key)][run][token.names[0]] = None
        for ours, theirs in gaps.values():
            for pair in zip(ours, theirs, strict=False):
                self._adopt(*pair)

    def _adopt(self, one: int, other: int) -> None:
        """Pair two names unless one of them is paired."""
        if min(one, other) >= self._known and other not in self._partner and one not in self._taken:
            self._partner[other] = one
            self._taken.add(one)

    def _labels(self, run: int, names: Iterable[int]) -> Names:
        """Return the names of A, or those of the partners for names of B; negative without a partner."""
        if run == 0:
            return tuple(names)
        return tuple(name if name < self._known else self._partner.get(name, -1 - name) for name in names)

    def _open(self, labels: Names) -> Names:
        """Return the names with -1 for those of one run only."""
        return tuple(name if name in self._taken or 0 <= name < self._known else -1 for name in labels)

    def _content(self, run: int, at: int) -> Hashable:
        """Return the key of an event and its names, with all unpaired names equal."""
        key, labels = self._key_and_names(run, at)
        return key, self._open(labels)

    def _thread(self, run: int, at: int) -> Hashable:
        """Return the goal, plan or Skiller of an event, equal for both runs."""
        key, names = self._tails[run][at].thread
        return key, self._labels(run, names)

    def _owner(self, run: int, at: int) -> Hashable:
        """Return the goal of an event if only one run has the goal."""
        names = self._labels(run, self._tails[run][at].thread[1][:1])
        return names if names and self._open(names) == (NONE,) else None

    def _without_repeated_details(self, edits: Iterable[Edit]) -> Iterator[Edit]:
        """Yield edits without repetitions of a detail that differs in all events of a goal or plan-action."""
        seen: set[Hashable] = set()
        for edit in edits:
            change = self._detail_change(edit)
            if change is None or change not in seen:
                seen.add(change)
                yield edit

    def _detail_change(self, edit: Edit) -> Hashable:
        """Return the differing details of a changed event, which its text does not show, or None."""
        if edit.kind is not DifferenceKind.CHANGED:
            return None
        return detail_change(self._key_and_names(0, edit.at[0]), self._key_and_names(1, edit.at[1]))

    def _key_and_names(self, run: int, at: int) -> NamedKey:
        """Return the key of an event and its names, equal for both runs."""
        token = self._tails[run][at]
        return token.key, self._labels(run, token.names)

    def _difference(self, edit: Edit) -> Difference:
        tokens = [self._tails[run][at] for run, at in enumerate(edit.at) if at != NONE]
        ours, theirs = self._side(0, edit), self._side(1, edit)
        return Difference(
            self._edit_text(edit), subject_of(tokens[0].event), ours, theirs, edit.kind, edit.count
        )

    def _side(self, run: int, edit: Edit) -> Side:
        at = edit.at[run]
        if at != NONE:
            token = self._tails[run][at]
            details = f" {describe_details(token.event)}" if self._detail_change(edit) else ""
            return Side(token.number, f"{describe(token.event)}{details}")
        before = self._alignment.before(1 - run, edit.at[1 - run])
        number = None if before == NONE else self._tails[run][before].number
        return Side(number, OVER if self._alignment.ends(run, edit) else NOTHING)

    def _edit_text(self, edit: Edit) -> str:
        if edit.kind is DifferenceKind.CHANGED:
            return changed_parts(self._key_and_names(0, edit.at[0]), self._key_and_names(1, edit.at[1]))
        events = "an event" if edit.count == 1 else f"{edit.count} events"
        if edit.kind is DifferenceKind.ORDER:
            later = edit.place[:2] == (edit.at[0], 0)
            return f"{events} in another order: {'later' if later else 'earlier'} in B"
        name, missing, other = ("A", 1, "B") if edit.kind is DifferenceKind.ONLY_A else ("B", 0, "A")
        if edit.whole:
            return f"a goal that only {name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._alignment.ends(missing, edit):
            return f"{other} ends here, {name} goes on"
        return f"{events} that only {name} has"

    def _line(self, run: int, at: int) -> EventLine:
        token = self._tails[run][at]
        return event_line(token.number, token.event, self._start_us[run])
