"""Edits between two sequences of states: moved, changed and additional states.

A state is an event as a comparison sees it. An :class:`Alignment` pairs the equal states of two runs in
order. A state without a partner is moved if the other run has its content elsewhere. The state is changed if
the other run has another state of the same goal, plan or Skiller in its place. Otherwise only one run has the
state.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter, itemgetter
from typing import Final, NamedTuple, TypeAlias

from cxbridge.trace.compare.align import MISSING, align, pop_equal_pairs
from cxbridge.trace.compare.model import DifferenceKind


class SortKey(NamedTuple):
    """The position of a state in a common order of the states of both runs.

    :param pair_count: the number of pairs before the state.
    :param run_index: the run of the state, 0 or 1.
    :param state_index: the index of the state in the run.
    """

    pair_count: int
    run_index: int
    state_index: int


StateProperty: TypeAlias = Callable[[int, int], Hashable]
"""Gets a run, 0 or 1, and an index; returns a property of the state."""

ONE_SIDED_KINDS: Final = (DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)
"""The kinds of differences of a state that only one run has; the index is the run, 0 or 1."""


@dataclass(slots=True)
class Edit:
    """A difference between two sequences.

    :param indices: the indices in both sequences; -1: the run has no such state.
    :param count: the number of consecutive states.
    :param is_whole_goal: whether the edit contains all states of a goal that only one run has.
    """

    kind: DifferenceKind
    indices: tuple[int, int]
    sort_key: SortKey
    count: int = 1
    is_whole_goal: bool = False

    @property
    def is_later_in_b(self) -> bool:
        """Whether a moved state comes later in B than in A."""
        # the sort key is that of the earlier position
        return self.sort_key.run_index == 0


class Alignment:
    """Two sequences of states and the pairs of equal states, in order.

    :ivar pairs: pairs of indices.
    """

    def __init__(self, a: Sequence[Hashable], b: Sequence[Hashable]) -> None:
        numbers: dict[Hashable, int] = {}
        self.pairs = align(
            *([numbers.setdefault(state, len(numbers)) for state in states] for states in (a, b))
        )
        self._lengths = (len(a), len(b))

    def unpaired_indices(self, run_index: int) -> list[int]:
        """Return the indices of the states of a run without a partner."""
        paired_indices = {pair[run_index] for pair in self.pairs}
        return [index for index in range(self._lengths[run_index]) if index not in paired_indices]

    def preceding_index(self, run_index: int, edit: Edit) -> int:
        """Return the index of a run's last paired state before a state of the other run only, or -1."""
        pair_count = edit.sort_key.pair_count
        return self.pairs[pair_count - 1][run_index] if pair_count else MISSING

    def has_ended(self, run_index: int, edit: Edit) -> bool:
        """Return whether a run has ended before a state that only the other run has."""
        is_last = self.preceding_index(run_index, edit) + 1 == self._lengths[run_index]
        return is_last and not edit.is_whole_goal

    def find_edits(self, content: StateProperty, thread: StateProperty, owner: StateProperty) -> list[Edit]:
        """Return the edits in the order of the runs.

        :param content: the property by which a moved state is recognised at another index.
        :param thread: the goal, plan or Skiller of a state. A state counts as changed if the other run has
            another state of the thread between the same pairs.
        :param owner: the goal of a state if only one run has the goal, else None. The states of such a goal
            become one edit.
        """
        unpaired_a, unpaired_b = self.unpaired_indices(0), self.unpaired_indices(1)
        thread_steps = [self._count_thread_steps(run_index, thread) for run_index in (0, 1)]
        # first the moved states: a late state must not be paired with another state as changed
        moved_pairs = pop_equal_pairs(unpaired_a, unpaired_b, partial(content, 0), partial(content, 1))
        changed_pairs = pop_equal_pairs(
            unpaired_a, unpaired_b, thread_steps[0].__getitem__, thread_steps[1].__getitem__
        )
        edits = [
            Edit(kind, pair, min(self._make_sort_key(0, pair[0]), self._make_sort_key(1, pair[1])))
            for kind, pairs in ((DifferenceKind.ORDER, moved_pairs), (DifferenceKind.CHANGED, changed_pairs))
            for pair in pairs
        ]
        goal_edits: dict[Hashable, Edit] = {}
        for run_index, index in (
            *((0, index) for index in unpaired_a),
            *((1, index) for index in unpaired_b),
        ):
            edit = Edit(
                ONE_SIDED_KINDS[run_index],
                (MISSING, index) if run_index else (index, MISSING),
                self._make_sort_key(run_index, index),
            )
            goal = owner(run_index, index)
            if goal is None:
                edits.append(edit)
            # a goal of one run is one difference, however many states it has and wherever they are
            elif goal_edits.setdefault((run_index, goal), edit) is not edit:
                goal_edits[run_index, goal].count += 1
        for edit in goal_edits.values():
            edit.is_whole_goal = True
        return _join_consecutive(sorted([*edits, *goal_edits.values()], key=attrgetter("sort_key")))

    def _count_thread_steps(self, run_index: int, thread: StateProperty) -> list[Hashable]:
        """Return, for each state of a run, its thread and the number of the thread's pairs before it."""
        counts: Counter[Hashable] = Counter()
        paired_indices = {pair[run_index] for pair in self.pairs}
        steps: list[Hashable] = []
        for index in range(self._lengths[run_index]):
            thread_id = thread(run_index, index)
            steps.append((thread_id, counts[thread_id]))
            counts[thread_id] += index in paired_indices
        return steps

    def _make_sort_key(self, run_index: int, index: int) -> SortKey:
        """Return the sort key of a state; between two pairs, states of A precede those of B."""
        return SortKey(bisect_left(self.pairs, index, key=itemgetter(run_index)), run_index, index)


def pair_sort_key(number: int) -> SortKey:
    """Return the sort key of a pair, after those of the states before it.

    :param number: the number of the pair, from 0.
    """
    return SortKey(number, len(ONE_SIDED_KINDS), 0)


def _join_consecutive(edits: Iterable[Edit]) -> list[Edit]:
    """Join consecutive edits of the same kind; changed states and whole goals are not joined.

    :param edits: sorted by position.
    """
    result: list[Edit] = []
    for edit in edits:
        previous_edit = result[-1] if result else None
        if (
            previous_edit is not None
            and previous_edit.kind is edit.kind is not DifferenceKind.CHANGED
            and not (previous_edit.is_whole_goal or edit.is_whole_goal)
            and edit.indices
            == tuple(
                MISSING if index == MISSING else index + previous_edit.count
                for index in previous_edit.indices
            )
        ):
            previous_edit.count += 1
        else:
            result.append(edit)
    return result
