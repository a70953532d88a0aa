"""Comparison of two sequences of steps: moved, changed and additional steps, and checks of the paired steps.

Steps with equal content are paired in order. A step without a partner is moved if the other sequence has its
content elsewhere. The step is changed if the other sequence has another step of the same goal, plan or
Skiller in its place. Otherwise only one sequence has the step.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter, itemgetter
from typing import Final, NamedTuple

from cxbridge.trace.compare.align import MISSING, align, pop_equal_pairs
from cxbridge.trace.compare.checks import PairChecks
from cxbridge.trace.compare.model import Difference, DifferenceKind, Side
from cxbridge.trace.compare.steps import DETAIL_KINDS, Step, describe_changes

ONE_SIDED_KINDS: Final = (DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)
"""The kinds of differences of a step that only one run has; the index is the run, 0 or 1."""


class Place(NamedTuple):
    """The place of a difference in a common order of both sequences.

    :param block_number: the number of blocks of pairs before the step, or before the block of a pair.
    :param rank: the run of a step without a partner, 0 or 1; 2 for a pair.
    :param step_index: the index of the step in its sequence; for a pair in the first sequence.
    """

    block_number: int
    rank: int
    step_index: int


@dataclass(slots=True)
class Edit:
    """Steps without partners.

    :param indices: the indices in both sequences; -1: the sequence has no such step.
    :param count: the number of steps; they are consecutive unless the edit is a whole goal.
    :param is_whole_goal: whether the edit contains all steps of a goal that only one run has.
    """

    kind: DifferenceKind
    indices: tuple[int, int]
    place: Place
    count: int = 1
    is_whole_goal: bool = False

    def continues(self, other: Edit) -> bool:
        """Return whether this edit, of one step, follows another edit and can be joined with it."""
        next_indices = tuple(index if index == MISSING else index + other.count for index in other.indices)
        return (
            self.kind is other.kind is not DifferenceKind.CHANGED
            and not (self.is_whole_goal or other.is_whole_goal)
            and self.indices == next_indices
        )


def compare_sequences(
    a: Sequence[Step],
    b: Sequence[Step],
    subject: str = "",
    *,
    tolerance_s: float | None = None,
    common_names: Collection[int] = (),
) -> Iterator[Difference]:
    """Yield the differences between two sequences in their order.

    :param subject: the goal, plan, Skiller or interface; empty: that of the first differing event.
    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    :param common_names: the names in both runs. The steps of a goal with another name are one difference.
    """
    yield from _SequencePair((a, b), subject, common_names).find_differences(PairChecks(tolerance_s))


class _SequencePair:
    """Two sequences of steps, with the blocks of their pairs and the steps without partners."""

    def __init__(
        self, sequences: tuple[Sequence[Step], Sequence[Step]], subject: str, common_names: Collection[int]
    ) -> None:
        self._sequences = sequences
        self._subject = subject
        self._common_names = common_names
        # hashes of a million steps need less memory than their contents; different contents hardly ever have
        # equal hashes
        self._blocks = align(*(array("q", (hash(step.content) for step in steps)) for steps in sequences))
        # the steps without partners, each with the number of blocks before it
        self._unpaired: tuple[dict[int, int], dict[int, int]] = ({}, {})
        for number in range(len(self._blocks)):
            for run, unpaired in enumerate(self._unpaired):
                gap = range(self._last_paired(number, run) + 1, self._blocks[number][run])
                unpaired.update(dict.fromkeys(gap, number))

    def _last_paired(self, block_number: int, run: int) -> int:
        """Return the index of a run's last pair before a block, or -1."""
        if not block_number:
            return MISSING
        *starts, size = self._blocks[block_number - 1]
        return starts[run] + size - 1

    def find_differences(self, checks: PairChecks) -> Iterator[Difference]:
        """Return the differences of steps without partners and those that checks find in pairs, in order."""
        placed_differences = [(edit.place, self._make_difference(edit)) for edit in self._find_edits()]
        steps_a, steps_b = self._sequences
        for number, (start_a, start_b, size) in enumerate(self._blocks):
            for run, (steps, start) in enumerate(((steps_a, start_a), (steps_b, start_b))):
                for step in steps[self._last_paired(number, run) + 1 : start]:
                    checks.note_unpaired(run, step)
            for offset in range(size):
                index = start_a + offset
                for difference in checks.find_differences(steps_a[index], steps_b[start_b + offset]):
                    difference.subject = self._subject
                    placed_differences.append((Place(number, len(ONE_SIDED_KINDS), index), difference))
        return (difference for _, difference in sorted(placed_differences, key=itemgetter(0)))

    def _find_edits(self) -> list[Edit]:
        """Return the edits in order, consecutive ones joined."""
        edits: list[Edit] = []
        remaining_indices = [*self._unpaired[0]], [*self._unpaired[1]]
        # first the moved steps: a late step must not be paired with another step as changed
        for kind, find_keys in (
            (DifferenceKind.ORDER, self._find_contents),
            (DifferenceKind.CHANGED, self._find_thread_steps),
        ):
            # without steps to pair, the count of a long run is needless
            if not all(remaining_indices):
                break
            pairs = pop_equal_pairs(*remaining_indices, find_keys(0).__getitem__, find_keys(1).__getitem__)
            edits += (Edit(kind, pair, min(map(self._find_place, (0, 1), pair))) for pair in pairs)
        goal_edits: dict[Hashable, Edit] = {}
        for run, kind in enumerate(ONE_SIDED_KINDS):
            for index in remaining_indices[run]:
                indices = (MISSING, index) if run else (index, MISSING)
                edit = Edit(kind, indices, self._find_place(run, index))
                _thread, names = self._sequences[run][index].thread
                if not names or names[0] in self._common_names:
                    edits.append(edit)
                # a goal of one run is one difference, however many steps it has and wherever they are
                elif (goal_edit := goal_edits.setdefault((run, names[0]), edit)) is not edit:
                    goal_edit.count += 1
        for edit in goal_edits.values():
            edit.is_whole_goal = True
        joined_edits: list[Edit] = []
        for edit in sorted([*edits, *goal_edits.values()], key=attrgetter("place")):
            if joined_edits and edit.continues(joined_edits[-1]):
                joined_edits[-1].count += 1
            else:
                joined_edits.append(edit)
        return joined_edits

    def _find_contents(self, run: int) -> Mapping[int, Hashable]:
        """Return the contents of the steps without partners."""
        return {index: self._sequences[run][index].content for index in self._unpaired[run]}

    def _find_thread_steps(self, run: int) -> Mapping[int, Hashable]:
        """Return the threads of the steps without partners, each with the number of its earlier pairs."""
        counts: Counter[Hashable] = Counter()
        thread_steps: dict[int, Hashable] = {}
        for index, step in enumerate(self._sequences[run]):
            thread = step.thread
            if index in self._unpaired[run]:
                thread_steps[index] = (thread, counts[thread])
            else:
                counts[thread] += 1
        return thread_steps

    def _find_place(self, run: int, index: int) -> Place:
        """Return the place of a step; between two blocks, steps of A precede those of B."""
        return Place(self._unpaired[run][index], run, index)

    def _make_difference(self, edit: Edit) -> Difference:
        side_a, side_b = (self._make_side(run, edit) for run in (0, 1))
        run = 0 if edit.indices[0] != MISSING else 1
        has_details = self._sequences[run][edit.indices[run]].key[0] in DETAIL_KINDS
        description = self._describe_edit(edit, has_details=has_details)
        return Difference(description, self._subject, side_a, side_b, edit.kind, edit.count, has_details)

    def _make_side(self, run: int, edit: Edit) -> Side:
        """Return the event of one run, or the event before the missing one."""
        index = edit.indices[run]
        if index != MISSING:
            return Side(self._sequences[run][index].position)
        last = self._last_paired(edit.place.block_number, run)
        text = "(nothing follows)" if self._has_ended(run, edit) else "(nothing here)"
        return Side(None if last == MISSING else self._sequences[run][last].position, text)

    def _has_ended(self, run: int, edit: Edit) -> bool:
        """Return whether a run has ended before the steps of the other run."""
        next_index = self._last_paired(edit.place.block_number, run) + 1
        return 0 < next_index == len(self._sequences[run]) and not edit.is_whole_goal

    def _describe_edit(self, edit: Edit, *, has_details: bool) -> str:
        if edit.kind is DifferenceKind.CHANGED:
            a, b = (steps[index] for steps, index in zip(self._sequences, edit.indices, strict=True))
            return describe_changes(a.content, b.content)
        noun, single_noun = ("value", "a value") if has_details else ("event", "an event")
        events = single_noun if edit.count == 1 else f"{edit.count} {noun}s"
        if edit.kind is DifferenceKind.ORDER:
            # the place of a moved step is the earlier of its two places; its rank is the run
            return f"{events} in another order: {'earlier' if edit.place.rank else 'later'} in B"
        run = ONE_SIDED_KINDS.index(edit.kind)
        name, other_name = "AB"[run], "BA"[run]
        if edit.is_whole_goal:
            return f"a goal that only {name} has, with {edit.count} event{'' if edit.count == 1 else 's'}"
        if self._has_ended(1 - run, edit):
            return f"{other_name} ends here, {name} continues"
        return f"{events} that only {name} has"
