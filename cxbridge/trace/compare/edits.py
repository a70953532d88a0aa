"""Edits between two sequences of states: moved, changed and additional states."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from operator import itemgetter
from typing import Final, TypeAlias

from cxbridge.trace.compare.align import NONE, align, rising, take_equal
from cxbridge.trace.compare.model import AlignedRow, DifferenceKind, EventLine

ROWS_BEFORE: Final = 6
"""The number of rows shown before the first difference."""

ROWS_AFTER: Final = 16
"""The number of rows shown from the first difference on."""

At: TypeAlias = Callable[[int, int], Hashable]
"""Returns a property of the state at an index of run 0 or 1."""

ALONE: Final = (DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)


@dataclass(slots=True)
class Edit:
    """A difference between two sequences.

    :param at: the indices in both sequences; -1: the run has no such state.
    :param place: the sort key in a common order of the states of both runs.
    :param count: the number of consecutive states.
    :param whole: whether the edit contains all states of a goal that only one run has.
    """

    kind: DifferenceKind
    at: tuple[int, int]
    place: tuple[int, int, int]
    count: int = 1
    whole: bool = False


class Alignment:
    """Two sequences of states and the pairs of equal states, in order.

    :ivar pairs: pairs of indices.
    """

    def __init__(self, a: Sequence[Hashable], b: Sequence[Hashable]) -> None:
        numbers: dict[Hashable, int] = {}
        self.pairs = align(*([numbers.setdefault(each, len(numbers)) for each in run] for run in (a, b)))
        self._ends = (len(a), len(b))
        self._beside = self.pairs  # replaced by the pairs and the changed states once the edits are known

    def loose(self, run: int) -> list[int]:
        """Return the indices of the states of a run without a partner."""
        paired = {pair[run] for pair in self.pairs}
        return [at for at in range(self._ends[run]) if at not in paired]

    def gap(self, run: int, at: int) -> int:
        """Return the number of pairs before a state."""
        return bisect_left(self.pairs, at, key=itemgetter(run))

    def before(self, run: int, at: int) -> int:
        """Return the index of the other run's last state before a state without partner, or -1."""
        gap = bisect_left(self._beside, at, key=itemgetter(run))
        return self._beside[gap - 1][1 - run] if gap else NONE

    def ends(self, run: int, edit: Edit) -> bool:
        """Return whether a run has ended at an edit that continues to the end of the other run."""
        at = edit.at[1 - run]
        if edit.whole or at + edit.count < self._ends[1 - run]:
            return False
        return self.before(1 - run, at) + 1 == self._ends[run]

    def edits(
        self,
        content: At,
        thread: At,
        *,
        owner: At | None = None,
        joined: tuple[DifferenceKind, ...] = (*ALONE, DifferenceKind.ORDER),
    ) -> list[Edit]:
        """Return the edits in the order of the runs.

        :param content: the part of a state that identifies it at another index.
        :param thread: the goal, plan or Skiller of a state. A state counts as changed if the other run has
            another state of the thread between the same pairs.
        :param owner: the goal of a state if only one run has the goal; its states become one edit.
        """
        ours, theirs = self.loose(0), self.loose(1)
        steps = [self._steps(run, thread) for run in (0, 1)]
        moved = take_equal(ours, theirs, partial(content, 0), partial(content, 1))
        changed = take_equal(ours, theirs, steps[0].__getitem__, steps[1].__getitem__)
        self._beside = rising(sorted([*self.pairs, *changed]))
        found = [
            Edit(kind, pair, min(self._place(0, pair[0]), self._place(1, pair[1])))
            for kind, pairs in ((DifferenceKind.ORDER, moved), (DifferenceKind.CHANGED, changed))
            for pair in pairs
        ]
        goals: dict[Hashable, Edit] = {}
        for run, at in chain(((0, at) for at in ours), ((1, at) for at in theirs)):
            edit = Edit(ALONE[run], (NONE, at) if run else (at, NONE), self._place(run, at))
            goal = owner(run, at) if owner else None
            if goal is None:
                found.append(edit)
            elif (run, goal) in goals:
                goals[run, goal].count += 1
            else:
                edit.whole = True
                goals[run, goal] = edit
        found += goals.values()
        return list(_joined(sorted(found, key=lambda edit: edit.place), joined))

    def _steps(self, run: int, thread: At) -> list[Hashable]:
        """Return, for each state of a run, its thread and the number of the thread's pairs before it."""
        counts: Counter[Hashable] = Counter()
        paired = {pair[run] for pair in self.pairs}
        steps: list[Hashable] = []
        for at in range(self._ends[run]):
            name = thread(run, at)
            steps.append((name, counts[name]))
            counts[name] += at in paired
        return steps

    def _place(self, run: int, at: int) -> tuple[int, int, int]:
        """Return the sort key of a state; in a gap, states of A precede those of B."""
        if run == 0:
            return (at, 0, at)
        gap = self.gap(1, at)
        return ((self.pairs[gap][0] if gap < len(self.pairs) else self._ends[0]) - 1, 1, at)

    def rows(self, line: Callable[[int, int], EventLine]) -> list[AlignedRow]:
        """Return both runs side by side around the first difference.

        :param line: returns the state of a run at an index as a line.
        """
        before: deque[AlignedRow] = deque(maxlen=ROWS_BEFORE)
        rows = (self._row((one, other), line, same=same) for one, other, same in self._places())
        for row in rows:
            if not row.same:
                ours, theirs = (each and replace(each, here=True) for each in (row.a, row.b))
                return [*before, AlignedRow(ours, theirs, same=False), *islice(rows, ROWS_AFTER - 1)]
            before.append(row)
        return list(before)

    @staticmethod
    def _row(at: Sequence[int], line: Callable[[int, int], EventLine], *, same: bool) -> AlignedRow:
        """Return the states at two indices as a row."""
        ours, theirs = (None if at[run] == NONE else line(run, at[run]) for run in (0, 1))
        return AlignedRow(ours, theirs, same)

    def _places(self) -> Iterator[tuple[int, int, bool]]:
        """Yield the indices of rows, with -1 for a gap, and whether they are pairs."""
        partners = set(self.pairs)
        next_a = next_b = 0
        for one, other in (*self._beside, self._ends):
            yield from ((at, NONE, False) for at in range(next_a, one))
            yield from ((NONE, at, False) for at in range(next_b, other))
            if one < self._ends[0]:
                yield one, other, (one, other) in partners
            next_a, next_b = one + 1, other + 1


def _joined(edits: Iterable[Edit], kinds: tuple[DifferenceKind, ...]) -> Iterator[Edit]:
    last: Edit | None = None
    for edit in edits:
        if last is not None and last.kind is edit.kind and edit.kind in kinds:
            following = tuple(NONE if at == NONE else at + last.count for at in last.at)
            if edit.at == following and not (last.whole or edit.whole):
                last.count += 1
                continue
        if last is not None:
            yield last
        last = edit
    if last is not None:
        yield last
