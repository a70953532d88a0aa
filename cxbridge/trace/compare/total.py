"""Comparison in total order: the runs must have equal events at equal positions.

Names, such as ids of goals, differ between runs. Up to the first difference both runs are read side by side,
and names are equal if they are new at the same position. The rest is aligned twice: first without names, so
that the paired events show which name of B stands for which name of A, then with these names.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Hashable, Iterable, Iterator
from operator import itemgetter
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.trace.compare.align import MISSING, pop_equal_pairs
from cxbridge.trace.compare.checks import MessageIdCheck, TimeCheck, describe_lag, message_stream
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.edits import Alignment, Edit, pair_sort_key
from cxbridge.trace.compare.keys import (
    DETAIL_NOUNS,
    NamedKey,
    Token,
    TokenReader,
    describe_changed_parts,
    describe_subject,
    find_changed_parts,
    find_thread,
)
from cxbridge.trace.compare.model import (
    Comparison,
    Difference,
    DifferenceKind,
    Order,
    Side,
)
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
    missing_details: MissingDetails | None = None,
) -> Comparison:
    """Compare two runs event by event up to the first difference, and align the rest.

    Only events without a partner count as different. For equal runs the memory stays constant.

    :param tolerance_s: the allowed difference between times; None: times are not compared.
    :param missing_details: details that are not compared.
    """
    readers = (
        TokenReader(a, view, selection, missing_details),
        TokenReader(b, view, selection, missing_details),
    )
    checks = _PartnerChecks(tolerance_s)
    differences: list[Difference] = []
    tokens_a, tokens_b = iter(readers[0]), iter(readers[1])
    # the last equal pairs, each with the number of names before it
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
                find_thread(token_a.key, token_a.names), token_a.event.time_us, token_b.event.time_us
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
        partner_names = self._pair_names()
        self._paired_names = frozenset(partner_names.values())
        # both runs have the names of A; a name of B without a partner becomes negative
        self._states: list[list[NamedKey]] = [
            [(token.key, token.names) for token in tails[0]],
            [
                (
                    token.key,
                    tuple(
                        name if name < shared_name_count else partner_names.get(name, -1 - name)
                        for name in token.names
                    ),
                )
                for token in tails[1]
            ],
        ]
        self._alignment = Alignment(*self._states)

    def _pair_names(self) -> dict[int, int]:
        """Return the names of A by those of B, by the votes of events that are equal except for names."""
        tails = self._tails
        alignment = Alignment(*([token.key for token in tail] for tail in tails))
        moved_pairs = pop_equal_pairs(
            alignment.unpaired_indices(0),
            alignment.unpaired_indices(1),
            lambda index: tails[0][index].key,
            lambda index: tails[1][index].key,
        )
        votes = Counter(
            pair
            for index_a, index_b in (*alignment.pairs, *moved_pairs)
            # a text that contains `gen#` itself has equal keys and fewer names
            for pair in zip(tails[0][index_a].names, tails[1][index_b].names, strict=False)
            if min(pair) >= self._shared_name_count
        )
        # names are paired one to one: a pair with fewer votes is dropped if a name of it is paired already
        partner_names: dict[int, int] = {}
        paired_names: set[int] = set()
        for (name_a, name_b), _ in votes.most_common():
            if name_b not in partner_names and name_a not in paired_names:
                partner_names[name_b] = name_a
                paired_names.add(name_a)
        return partner_names

    def find_differences(self, checks: _PartnerChecks, checked_count: int) -> list[Difference]:
        """Return all differences in the order of the runs.

        :param checked_count: the number of leading pairs that were checked while reading.
        """
        edits = self._alignment.find_edits(
            lambda run_index, index: self._states[run_index][index], self._find_thread, self._find_owner
        )
        differences = [
            (edit.sort_key, self._make_difference(edit)) for edit in self._drop_repeated_details(edits)
        ]
        last_a = last_b = MISSING
        for number, (index_a, index_b) in enumerate(self._alignment.pairs):
            for token in (*self._tails[0][last_a + 1 : index_a], *self._tails[1][last_b + 1 : index_b]):
                checks.note_unpaired(token)
            if not index_a == index_b < checked_count:
                partners = self._tails[0][index_a], self._tails[1][index_b]
                differences += (
                    (pair_sort_key(number), difference) for difference in checks.find_differences(*partners)
                )
            last_a, last_b = index_a, index_b
        return [difference for _, difference in sorted(differences, key=itemgetter(0))]

    def _find_thread(self, run_index: int, index: int) -> NamedKey:
        """Return the goal, plan or Skiller of an event, equal for both runs."""
        return find_thread(*self._states[run_index][index])

    def _find_owner(self, run_index: int, index: int) -> int | None:
        """Return the name of the event's goal if only one run has the goal, else None."""
        _parts, names = self._find_thread(run_index, index)
        if not names:
            return None
        goal_name = names[0]
        is_shared = 0 <= goal_name < self._shared_name_count or goal_name in self._paired_names
        return None if is_shared else goal_name

    def _drop_repeated_details(self, edits: Iterable[Edit]) -> Iterator[Edit]:
        """Yield edits without repetitions of a detail that differs in all events of a goal or plan-action."""
        reported_details: set[Hashable] = set()
        for edit in edits:
            details = self._find_changed_details(edit)
            if details is None or details not in reported_details:
                reported_details.add(details)
                yield edit

    def _find_changed_details(self, edit: Edit) -> Hashable:
        """Return subject and details of a changed event if only details differ, else None."""
        if edit.kind is not DifferenceKind.CHANGED or not DETAIL_NOUNS.issuperset(self._changed_parts(edit)):
            return None
        event_a, event_b = (tail[index].event for tail, index in zip(self._tails, edit.indices, strict=True))
        subject = tuple(getattr(event_a, name) for name in event_a.KIND.subject_fields)
        return subject, describe_details(event_a), describe_details(event_b)

    def _changed_parts(self, edit: Edit) -> list[str]:
        """Return the nouns of the parts in which a changed event differs."""
        key_a, key_b = (states[index] for states, index in zip(self._states, edit.indices, strict=True))
        return find_changed_parts(key_a, key_b)

    def _make_difference(self, edit: Edit) -> Difference:
        tokens = [
            None if index == MISSING else tail[index]
            for tail, index in zip(self._tails, edit.indices, strict=True)
        ]
        # the text of an event does not show its details
        with_details = self._find_changed_details(edit) is not None
        side_a, side_b = (
            self._make_missing_side(run_index, edit)
            if token is None
            else Side(token.number, _describe_token(token, with_details=with_details))
            for run_index, token in enumerate(tokens)
        )
        return Difference(
            self._describe_edit(edit),
            describe_subject(next(token.event for token in tokens if token)),
            side_a,
            side_b,
            edit.kind,
            edit.count,
        )

    def _make_missing_side(self, run_index: int, edit: Edit) -> Side:
        """Return the side of a run without an event."""
        preceding_index = self._alignment.preceding_index(run_index, edit)
        number = None if preceding_index == MISSING else self._tails[run_index][preceding_index].number
        return Side(number, RUN_OVER_TEXT if self._alignment.has_ended(run_index, edit) else NO_EVENT_TEXT)

    def _describe_edit(self, edit: Edit) -> str:
        if edit.kind is DifferenceKind.CHANGED:
            return describe_changed_parts(self._changed_parts(edit))
        events = "an event" if edit.count == 1 else f"{edit.count} events"
        if edit.kind is DifferenceKind.ORDER:
            return f"{events} in another order: {'later' if edit.is_later_in_b else 'earlier'} in B"
        run_name, other_index, other_name = (
            ("A", 1, "B") if edit.kind is DifferenceKind.ONLY_A else ("B", 0, "A")
        )
        if edit.is_whole_goal:
            return f"a goal that only {run_name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._alignment.has_ended(other_index, edit):
            return f"{other_name} ends here, {run_name} continues"
        return f"{events} that only {run_name} has"


def _describe_token(token: Token, *, with_details: bool) -> str:
    text = describe_event(token.event)
    return f"{text} {describe_details(token.event)}" if with_details else text
