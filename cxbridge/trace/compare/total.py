"""Comparison in total order: the runs must have equal events at equal positions.

Names, such as ids of goals, differ between runs. Up to the first difference both runs are read side by side,
and names are equal if they are new at the same position. The rest is aligned twice: first without names, so
that the paired events show which name of B stands for which name of A, then with these names.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Hashable, Iterable, Iterator
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.trace.compare.align import MISSING, pop_equal_pairs
from cxbridge.trace.compare.checks import MessageIdCheck, TimeCheck, describe_lag, message_stream
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.edits import Alignment, Edit
from cxbridge.trace.compare.keys import (
    NamedKey,
    Token,
    TokenReader,
    describe_changed_parts,
    describe_subject,
    detail_change,
)
from cxbridge.trace.compare.model import (
    Comparison,
    Difference,
    DifferenceKind,
    Order,
    Side,
)
from cxbridge.trace.compare.names import Names
from cxbridge.trace.compare.selection import Selection
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe_details, describe_event

NO_EVENT_TEXT = "(nothing here)"
"""The text of a missing event."""

RUN_OVER_TEXT = "(the run is over)"
"""The text of a missing event after the end of a run."""

WINDOW_SIZE: Final = 2000
"""The number of events before the first difference that are aligned again.

If several equal goals are new in these events, only later events show which of the goals are partners.
"""


def compare_total(
    a: Run,
    b: Run,
    view: View,
    selection: Selection | None = None,
    tolerance_s: float | None = None,
    missing: MissingDetails | None = None,
) -> Comparison:
    """Compare two runs event by event up to the first difference, and align the rest.

    Only events without a partner count as different. For equal runs the memory stays constant.

    :param tolerance_s: the allowed difference between times; None: times are not compared.
    :param missing: details that are not compared.
    """
    readers = (TokenReader(a, view, selection, missing), TokenReader(b, view, selection, missing))
    checks = _PartnerChecks(tolerance_s)
    differences: list[Difference] = []
    tokens_a, tokens_b = iter(readers[0]), iter(readers[1])
    window: deque[tuple[tuple[Token, Token], int]] = deque(maxlen=WINDOW_SIZE)
    while True:
        # names are numbered by first appearance, so equal numbers mean the same name up to here
        shared_name_count = len(readers[0].namer)
        token_a, token_b = next(tokens_a, None), next(tokens_b, None)
        if token_a is None or token_b is None or token_a.key != token_b.key or token_a.names != token_b.names:
            break
        window.append(((token_a, token_b), shared_name_count))
        # most events have neither a message id nor a compared time, and this is the inner loop
        if tolerance_s is not None or token_a.msgid is not None or token_b.msgid is not None:
            differences += checks.find_differences(token_a, token_b)
    tails = [
        [*([] if token is None else [token]), *rest]
        for token, rest in ((token_a, tokens_a), (token_b, tokens_b))
    ]
    if any(tails):
        # equal goals that are new in the window may be paired differently: only earlier names are certain
        certain_name_count = window[0][1] if window else shared_name_count
        tails = [[*(pair[run_index] for pair, _ in window), *tail] for run_index, tail in enumerate(tails)]
        differences += _Divergence(tails, certain_name_count).find_differences(checks, len(window))
    return Comparison(view, Order.TOTAL, readers[0].count, readers[1].count, differences)


class _PartnerChecks:
    """Finds differences between paired equal events: message ids and times."""

    def __init__(self, tolerance_s: float | None) -> None:
        self._msgids = MessageIdCheck()
        self._times = None if tolerance_s is None else TimeCheck(tolerance_s)

    def find_differences(self, token_a: Token, token_b: Token) -> Iterator[Difference]:
        """Yield the differences between the next pair."""
        if self._msgids.has_new_offset(message_stream(token_a.key), token_a.msgid or 0, token_b.msgid or 0):
            yield _make_partner_difference(token_a, token_b, DifferenceKind.MSGID, "another message id")
        if self._times:
            lag_s = self._times.measure_exceeding_lag_s(
                token_a.thread, token_a.event.time_us, token_b.event.time_us
            )
            if lag_s is not None:
                yield _make_partner_difference(token_a, token_b, DifferenceKind.TIME, describe_lag(lag_s))

    def note_unpaired(self, token: Token) -> None:
        """Note an event that only one run has: such an event may shift the later message ids."""
        if token.msgid is not None:
            self._msgids.forget_offset(message_stream(token.key))


def _make_partner_difference(token_a: Token, token_b: Token, kind: DifferenceKind, text: str) -> Difference:
    side_a, side_b = (Side(token.number, describe_event(token.event)) for token in (token_a, token_b))
    return Difference(text, describe_subject(token_a.event), side_a, side_b, kind)


class _Divergence:
    """The rest of two runs, with one name for both goals of a pair.

    :param tails: the events of both runs.
    :param shared_name_count: the number of names that are equal in both runs.
    """

    def __init__(self, tails: list[list[Token]], shared_name_count: int) -> None:
        self._tails = tails
        self._shared_name_count = shared_name_count
        self._partner_names: dict[int, int] = {}  # names of B to names of A
        self._pair_names()
        states = [
            [self._key_and_names(run_index, index) for index in range(len(tail))]
            for run_index, tail in enumerate(tails)
        ]
        self._alignment = Alignment(*states)

    def _pair_names(self) -> None:
        """Find which name of B is which name of A by the votes of events that are equal except for names."""
        alignment = Alignment(*([token.key for token in tail] for tail in self._tails))
        moved_pairs = pop_equal_pairs(
            alignment.unpaired_indices(0),
            alignment.unpaired_indices(1),
            lambda index: self._tails[0][index].key,
            lambda index: self._tails[1][index].key,
        )
        votes = Counter(
            pair
            for index_a, index_b in (*alignment.pairs, *moved_pairs)
            # a text that contains `gen#` itself has equal keys and fewer names
            for pair in zip(self._tails[0][index_a].names, self._tails[1][index_b].names, strict=False)
            if min(pair) >= self._shared_name_count
        )
        # names are paired one to one: a pair with fewer votes is dropped if a name of it is paired already
        paired_names: set[int] = set()
        for (name_a, name_b), _ in votes.most_common():
            if name_b not in self._partner_names and name_a not in paired_names:
                self._partner_names[name_b] = name_a
                paired_names.add(name_a)

    def find_differences(self, checks: _PartnerChecks, checked_count: int) -> list[Difference]:
        """Return all differences in the order of the runs.

        :param checked_count: the number of leading pairs that were checked while reading.
        """
        edits = self._alignment.find_edits(self._key_and_names, self._find_thread, owner=self._find_owner)
        differences = [
            (edit.sort_key, self._make_difference(edit)) for edit in self._drop_repeated_details(edits)
        ]
        last_a = last_b = MISSING
        for index_a, index_b in self._alignment.pairs:
            for token in (*self._tails[0][last_a + 1 : index_a], *self._tails[1][last_b + 1 : index_b]):
                checks.note_unpaired(token)
            if not index_a == index_b < checked_count:
                partners = self._tails[0][index_a], self._tails[1][index_b]
                differences += (
                    ((index_a, 0, index_a), difference) for difference in checks.find_differences(*partners)
                )
            last_a, last_b = index_a, index_b
        return [difference for _, difference in sorted(differences, key=lambda difference: difference[0])]

    def _translate_names(self, run_index: int, names: Iterable[int]) -> Names:
        """Translate the names of a run to those of A; a name of B without a partner becomes negative."""
        if run_index == 0:
            return tuple(names)
        return tuple(
            name if name < self._shared_name_count else self._partner_names.get(name, -1 - name)
            for name in names
        )

    def _find_thread(self, run_index: int, index: int) -> Hashable:
        """Return the goal, plan or Skiller of an event, equal for both runs."""
        key, names = self._tails[run_index][index].thread
        return key, self._translate_names(run_index, names)

    def _find_owner(self, run_index: int, index: int) -> Hashable:
        """Return the goal of an event if only one run has the goal, else None."""
        goal_name = self._tails[run_index][index].thread[1][:1]
        # the values are the paired names of A, the keys those of B
        paired_names = (self._partner_names.values(), self._partner_names)[run_index]
        if not goal_name or goal_name[0] < self._shared_name_count or goal_name[0] in paired_names:
            return None
        return goal_name

    def _drop_repeated_details(self, edits: Iterable[Edit]) -> Iterator[Edit]:
        """Yield edits without repetitions of a detail that differs in all events of a goal or plan-action."""
        reported: set[Hashable] = set()
        for edit in edits:
            change = self._find_detail_change(edit)
            if change is None or change not in reported:
                reported.add(change)
                yield edit

    def _find_detail_change(self, edit: Edit) -> Hashable:
        """Return the differing details of a changed event if nothing else differs, else None.

        The text of an event does not show its details.
        """
        if edit.kind is not DifferenceKind.CHANGED:
            return None
        return detail_change(self._key_and_names(0, edit.indices[0]), self._key_and_names(1, edit.indices[1]))

    def _key_and_names(self, run_index: int, index: int) -> NamedKey:
        """Return the key of an event and its names, which are equal for partners in both runs."""
        token = self._tails[run_index][index]
        return token.key, self._translate_names(run_index, token.names)

    def _make_difference(self, edit: Edit) -> Difference:
        tokens = [
            self._tails[run_index][index] for run_index, index in enumerate(edit.indices) if index != MISSING
        ]
        side_a, side_b = self._make_side(0, edit), self._make_side(1, edit)
        return Difference(
            self._describe_edit(edit),
            describe_subject(tokens[0].event),
            side_a,
            side_b,
            edit.kind,
            edit.count,
        )

    def _make_side(self, run_index: int, edit: Edit) -> Side:
        index = edit.indices[run_index]
        if index != MISSING:
            token = self._tails[run_index][index]
            details = f" {describe_details(token.event)}" if self._find_detail_change(edit) else ""
            return Side(token.number, f"{describe_event(token.event)}{details}")
        preceding_index = self._alignment.preceding_index(1 - run_index, edit.indices[1 - run_index])
        number = None if preceding_index == MISSING else self._tails[run_index][preceding_index].number
        return Side(number, RUN_OVER_TEXT if self._alignment.has_ended(run_index, edit) else NO_EVENT_TEXT)

    def _describe_edit(self, edit: Edit) -> str:
        if edit.kind is DifferenceKind.CHANGED:
            return describe_changed_parts(
                self._key_and_names(0, edit.indices[0]), self._key_and_names(1, edit.indices[1])
            )
        events = "an event" if edit.count == 1 else f"{edit.count} events"
        if edit.kind is DifferenceKind.ORDER:
            is_later = edit.sort_key[:2] == (edit.indices[0], 0)
            return f"{events} in another order: {'later' if is_later else 'earlier'} in B"
        run_name, other_index, other_name = (
            ("A", 1, "B") if edit.kind is DifferenceKind.ONLY_A else ("B", 0, "A")
        )
        if edit.is_whole_goal:
            return f"a goal that only {run_name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._alignment.has_ended(other_index, edit):
            return f"{other_name} ends here, {run_name} continues"
        return f"{events} that only {run_name} has"
