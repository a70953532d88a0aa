"""Alignment: partners are equal, in order, and as many as there can be when the edits are few."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.trace.compare.align import align

few = st.lists(st.integers(0, 4), max_size=14)


def longest_common(a: Sequence[int], b: Sequence[int]) -> int:
    """Length of a longest common subsequence, by the book."""
    row = [0] * (len(b) + 1)
    for one in a:
        before = 0
        for at, other in enumerate(b, 1):
            before, row[at] = row[at], before + 1 if one == other else max(row[at], row[at - 1])
    return row[-1]


def check(a: Sequence[int], b: Sequence[int]) -> int:
    """The number of partners; they must be partners."""
    pairs = align(a, b)
    assert all(a[one] == b[other] for one, other in pairs)
    for run in (0, 1):
        indices = [pair[run] for pair in pairs]
        assert indices == sorted(set(indices))
    return len(pairs)


@given(few, few)
def test_a_short_edit_is_the_shortest(a: list[int], b: list[int]) -> None:
    assert check(a, b) == longest_common(a, b)


def test_what_both_have_once_is_found_among_much_that_differs() -> None:
    a = [*range(1000), *range(5000, 5500)]
    b = [*range(2000, 3000), *range(5000, 5500)]
    b[500:500] = [7, 8, 9]
    assert check(a, b) == 503


def test_repetitions_are_aligned_by_runs() -> None:
    """Rules fire again and again: hardly one comes only once, but some sequences do."""
    a = [at * at % 23 for at in range(2000)]
    a[1000:1000] = [90, 91, 90, 92, 91]
    b = [each for at, each in enumerate(a) if at % 11]
    assert check(a, b) > 0.9 * len(b)
