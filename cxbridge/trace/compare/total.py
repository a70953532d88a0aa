"""Comparison in total order: the runs must have equal events at equal positions.

Names, such as ids of goals, differ between runs. Up to the first difference both runs are read side by side,
and names are equal if they are new at the same position. The rest is aligned twice: first without names, so
that the paired events show which name of B stands for which name of A, then with these names.
"""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Hashable, Iterable, Iterator
from typing import Final

from cxbridge.event_kinds import View
from cxbridge.trace.compare.align import MISSING
from cxbridge.trace.compare.checks import MessageIdCheck, TimeCheck, Tolerance, describe_lag, message_stream
from cxbridge.trace.compare.context import event_line
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.edits import Alignment, Edit
from cxbridge.trace.compare.keys import (
    NamedKey,
    Token,
    TokenReader,
    describe_changed_parts,
    describe_subject,
    detail_change,
    key_scope,
    scenario_hints,
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
from cxbridge.trace.listing import describe_details, describe_event

NO_EVENT_TEXT = "(nothing here)"
"""The text of a missing event."""

RUN_OVER_TEXT = "(the run is over)"
"""The text of a missing event after the end of a run."""

WINDOW_SIZE: Final = 2000
"""The number of events before the first difference that are aligned again.

If several equal goals are new in these events, only later events show which of the goals are partners.
"""

_UNPAIRED_NAME: Final = -1  # stands for all names that only one run has


def compare_total(
    a: Run,
    b: Run,
    view: View,
    selection: Selection | None = None,
    tolerance: Tolerance | None = None,
    missing: MissingDetails | None = None,
) -> Comparison:
    """Compare two runs event by event up to the first difference, and align the rest.

    Only events without a partner count as different. For equal runs the memory stays constant.

    :param missing: details that are not compared.
    """
    readers = (TokenReader(a, view, selection, missing), TokenReader(b, view, selection, missing))
    checks = _PartnerChecks(tolerance)
    differences: list[Difference] = []
    window: deque[tuple[Token, Token, int]] = deque(maxlen=WINDOW_SIZE)
    tokens_a, tokens_b = iter(readers[0]), iter(readers[1])
    while True:
        # names are numbered by first appearance, so equal numbers mean the same name up to here
        shared_name_count = len(readers[0].namer)
        token_a, token_b = next(tokens_a, None), next(tokens_b, None)
        if token_a is None or token_b is None or token_a.key != token_b.key or token_a.names != token_b.names:
            break
        window.append((token_a, token_b, shared_name_count))
        # most events have neither a message id nor a compared time, and this is the inner loop
        if tolerance or token_a.msgid is not None or token_b.msgid is not None:
            differences += checks.find_differences(token_a, token_b)
    tails = [
        [*compared_tokens, *([] if token is None else [token]), *rest]
        for compared_tokens, token, rest in (
            ([pair[0] for pair in window], token_a, tokens_a),
            ([pair[1] for pair in window], token_b, tokens_b),
        )
    ]
    comparison = Comparison(view, Order.TOTAL, readers[0].count, readers[1].count)
    if len(window) < max(map(len, tails)):
        # the alignment may pair names that are new in the window differently: only earlier names are certain
        shared_name_count = window[0][2] if window else shared_name_count
        divergence = Divergence(tails, shared_name_count, (readers[0].start_us, readers[1].start_us))
        is_first = not differences
        differences += divergence.find_differences(checks, len(window))
        # rows show the first difference: a difference before the divergence is a message id or a time, and
        # the events around are equal
        comparison.rows = divergence.make_rows() if is_first else []
        longer = max(comparison.count_a, comparison.count_b)
        comparison.paired_share = (longer - divergence.unpaired_count) / longer
        comparison.hints = divergence.make_hints(differences)
    comparison.keep(differences)
    return comparison


class _PartnerChecks:
    """Finds differences between paired equal events: message ids and times."""

    def __init__(self, tolerance: Tolerance | None) -> None:
        self._msgids = MessageIdCheck()
        self._times = TimeCheck(tolerance) if tolerance else None

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
        """Note an event that only one run has, which may shift the message ids after it."""
        if token.msgid is not None:
            self._msgids.forget_offset(message_stream(token.key))


def _make_partner_difference(token_a: Token, token_b: Token, kind: DifferenceKind, text: str) -> Difference:
    side_a, side_b = (Side(token.number, describe_event(token.event)) for token in (token_a, token_b))
    return Difference(text, describe_subject(token_a.event), side_a, side_b, kind)


class Divergence:
    """The rest of two runs from the first difference on, with one name for both goals of a pair.

    :param tails: the events of both runs.
    :param shared_name_count: the number of names that are equal in both runs.
    :param start_us: the start of each run in microseconds.
    """

    def __init__(self, tails: list[list[Token]], shared_name_count: int, start_us: tuple[int, int]) -> None:
        self._tails = tails
        self._shared_name_count = shared_name_count
        self._start_us = start_us
        self._partner_names: dict[int, int] = {}  # names of B to names of A
        self._paired_names: set[int] = set()  # names of A that have a partner
        # the first alignment ignores names: its pairs of events show which name of B is which name of A
        self._alignment = Alignment(*([token.key for token in tail] for tail in tails))
        if any(token.names for tail in tails for token in tail):
            self._pair_names_by_votes()
            states = [
                [self._key_and_names(run_index, index) for index in range(len(tail))]
                for run_index, tail in enumerate(tails)
            ]
            self._alignment = Alignment(*states)
            self._pair_names_of_new_goals()

    @property
    def unpaired_count(self) -> int:
        """The number of events of the longer rest without a partner."""
        return max(map(len, self._tails)) - len(self._alignment.pairs)

    def find_differences(self, checks: _PartnerChecks, checked_count: int) -> list[Difference]:
        """Return all differences in the order of the runs.

        :param checked_count: the number of leading pairs that were checked while reading.
        """
        edits = self._alignment.find_edits(self._make_masked_state, self._find_thread, owner=self._find_owner)
        differences = [
            (edit.sort_key, self._make_difference(edit)) for edit in self._drop_repeated_details(edits)
        ]
        starts = [(MISSING, MISSING), *self._alignment.pairs]
        # not strict: `starts` has one element more, since the last pair precedes no other
        for (last_a, last_b), (index_a, index_b) in zip(starts, self._alignment.pairs, strict=False):
            for token in (*self._tails[0][last_a + 1 : index_a], *self._tails[1][last_b + 1 : index_b]):
                checks.note_unpaired(token)
            if not index_a == index_b < checked_count:
                partners = self._tails[0][index_a], self._tails[1][index_b]
                differences += (
                    ((index_a, 0, index_a), difference) for difference in checks.find_differences(*partners)
                )
        return [difference for _, difference in sorted(differences, key=lambda difference: difference[0])]

    def make_rows(self) -> list[AlignedRow]:
        """Return both runs side by side around the first difference."""
        return self._alignment.make_rows(self._make_event_line)

    def make_hints(self, differences: list[Difference]) -> list[str]:
        """Return hints for the user."""
        if all(difference.kind is DifferenceKind.ORDER for difference in differences):
            return ["only the order differs: compare with --order partial if the order does not matter"]
        scopes = [{key_scope(key) for key in {token.key for token in tail}} for tail in self._tails]
        return scenario_hints(*scopes)

    def _pair_names_by_votes(self) -> None:
        """Pair the names of both runs by the votes of paired events; the most votes win."""
        votes = Counter(
            pair
            for index_a, index_b in self._alignment.pairs
            # a text that contains `gen#` itself has equal keys and fewer names
            for pair in zip(self._tails[0][index_a].names, self._tails[1][index_b].names, strict=False)
        )
        # names are paired one to one: a pair with fewer votes is dropped if a name of it is paired already
        for pair, _ in votes.most_common():
            self._pair_names(*pair)

    def _pair_names_of_new_goals(self) -> None:
        """Pair goals that only one run has and that are in the same gap, if their kinds allow it."""
        gaps: dict[Hashable, tuple[dict[int, None], dict[int, None]]] = defaultdict(lambda: ({}, {}))
        for run_index in (0, 1):
            for index in self._alignment.unpaired_indices(run_index):
                token = self._tails[run_index][index]
                if token.key[0] == "goal" and self._find_owner(run_index, index) is not None:
                    gaps[self._alignment.pairs_before(run_index, index), thread_key(token.key)][run_index][
                        token.names[0]
                    ] = None
        for names_a, names_b in gaps.values():
            for pair in zip(names_a, names_b, strict=False):  # one run may have more new goals
                self._pair_names(*pair)

    def _pair_names(self, name_a: int, name_b: int) -> None:
        """Pair two names unless one of them is paired."""
        if (
            min(name_a, name_b) >= self._shared_name_count
            and name_b not in self._partner_names
            and name_a not in self._paired_names
        ):
            self._partner_names[name_b] = name_a
            self._paired_names.add(name_a)

    def _translate_names(self, run_index: int, names: Iterable[int]) -> Names:
        """Translate the names of a run to those of A; a name of B without a partner becomes negative."""
        if run_index == 0:
            return tuple(names)
        return tuple(
            name if name < self._shared_name_count else self._partner_names.get(name, -1 - name)
            for name in names
        )

    def _mask_unpaired(self, names: Names) -> Names:
        """Return the names, with `_UNPAIRED_NAME` for each name that only one run has."""
        return tuple(
            name if name in self._paired_names or 0 <= name < self._shared_name_count else _UNPAIRED_NAME
            for name in names
        )

    def _make_masked_state(self, run_index: int, index: int) -> Hashable:
        """Return the key of an event and its names; all names that only one run has are equal."""
        key, names = self._key_and_names(run_index, index)
        return key, self._mask_unpaired(names)

    def _find_thread(self, run_index: int, index: int) -> Hashable:
        """Return the goal, plan or Skiller of an event, equal for both runs."""
        key, names = self._tails[run_index][index].thread
        return key, self._translate_names(run_index, names)

    def _find_owner(self, run_index: int, index: int) -> Hashable:
        """Return the goal of an event if only one run has the goal, else None."""
        names = self._translate_names(run_index, self._tails[run_index][index].thread[1][:1])
        return names if names and self._mask_unpaired(names) == (_UNPAIRED_NAME,) else None

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

    def _make_event_line(self, run_index: int, index: int) -> EventLine:
        token = self._tails[run_index][index]
        return event_line(token.number, token.event, self._start_us[run_index])
