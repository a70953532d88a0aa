"""Alignments: partners are equal and ordered, and their number is maximal for few edits."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.trace.compare.align import align

few = st.lists(st.integers(0, 4), max_size=14)


def longest_common(a: Sequence[int], b: Sequence[int]) -> int:
    """Return the length of a longest common subsequence."""
    row = [0] * (len(b) + 1)
    for left in a:
        before = 0
        for at, right in enumerate(b, 1):
            before, row[at] = row[at], before + 1 if left == right else max(row[at], row[at - 1])
    return row[-1]


def count_partners(a: Sequence[int], b: Sequence[int]) -> int:
    """Return the number of partners; check that partners are equal and ordered."""
    pairs = [(left + at, right + at) for left, right, size in align(a, b) for at in range(size)]
    assert all(a[left] == b[right] for left, right in pairs)
    for run in (0, 1):
        indices = [pair[run] for pair in pairs]
        assert indices == sorted(set(indices))
    return len(pairs)


@given(few, few)
def test_short_alignment_is_maximal(a: list[int], b: list[int]) -> None:
    assert count_partners(a, b) == longest_common(a, b)


def test_unique_events_are_aligned_among_differences() -> None:
    a = [*range(1000), *range(5000, 5500)]
    b = [*range(2000, 3000), *range(5000, 5500)]
    b[500:500] = [7, 8, 9]
    assert count_partners(a, b) == 503


def test_repetitions_are_aligned_by_sequences() -> None:
    """Rules fire repeatedly: few events are unique, but some sequences are."""
    a = [at * at % 23 for at in range(2000)]
    a[1000:1000] = [90, 91, 90, 92, 91]
    b = [value for at, value in enumerate(a) if at % 11]
    assert count_partners(a, b) > 0.9 * len(b)
