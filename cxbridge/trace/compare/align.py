"""Alignment of two sequences: pairs of equal items in order.

Short edits are found exactly by Myers' algorithm. Ranges with little in common are split at items, or short
runs of items, that occur once in both (as in "patience" diffs). The time thus grows with the length instead
of its square.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any, Final, TypeAlias, TypeVar

MAX_EDITS: Final = 64
"""The maximal number of insertions and deletions in a range for the exact algorithm.

Its time grows with the square of this number.
"""

# longer runs are more likely unique, but less likely common
RUNS: Final = (1, 3, 8)
"""The lengths of runs of items at which ranges are split."""

NONE: Final = -1
"""The index of a missing item."""

Item = TypeVar("Item", bound=Hashable)
Range: TypeAlias = tuple[int, int, int, int]
"""Start and end in the first sequence, start and end in the second."""

Chain: TypeAlias = tuple[Any, tuple[int, int, int]] | None
"""A linked list of equal runs: the chain before the last run, and the last run as two starts and a length."""


def align(a: Sequence[int], b: Sequence[int]) -> list[tuple[int, int]]:
    """Return the pairs of indices of equal items; both indices increase."""
    pairs: list[tuple[int, int]] = []
    stack: list[Range] = [(0, len(a), 0, len(b))]
    while stack:
        a_from, a_to, b_from, b_to = stack.pop()
        # equal starts and ends are most of two similar runs, and cost nothing here
        while a_from < a_to and b_from < b_to and a[a_from] == b[b_from]:
            pairs.append((a_from, b_from))
            a_from, b_from = a_from + 1, b_from + 1
        while a_from < a_to and b_from < b_to and a[a_to - 1] == b[b_to - 1]:
            a_to, b_to = a_to - 1, b_to - 1
            pairs.append((a_to, b_to))
        if a_from == a_to or b_from == b_to:
            continue
        ranges = (a_from, a_to, b_from, b_to)
        path, end = _furthest(a, b, ranges)
        # few edits: the exact path; many edits: split the ranges at unique items
        cuts = [] if end == (a_to, b_to) else _cuts(a, b, ranges)
        if not cuts:
            cuts = [
                (index_a + i, index_b + i) for index_a, index_b, length in _links(path) for i in range(length)
            ]
            if end == (a_to, b_to):
                pairs += cuts
            # no item is unique: the path so far counts if its pairs are more than a third of the items on it;
            # fewer pairs are coincidences
            elif 3 * len(cuts) > end[0] - a_from + end[1] - b_from:
                pairs += cuts
                stack.append((end[0], a_to, end[1], b_to))
            continue
        pairs += cuts
        starts = [(a_from, b_from), *((index_a + 1, index_b + 1) for index_a, index_b in cuts)]
        for (index_a, index_b), (next_a, next_b) in zip(starts, [*cuts, (a_to, b_to)], strict=True):
            stack.append((index_a, next_a, index_b, next_b))
    return sorted(pairs)


def _furthest(a: Sequence[int], b: Sequence[int], ranges: Range) -> tuple[Chain, tuple[int, int]]:
    """Return the equal runs on the path with the fewest edits, and the end of the path."""
    a_from, a_to, b_from, b_to = ranges
    reach: dict[int, tuple[int, Chain]] = {1: (a_from, None)}
    candidates: list[tuple[int, int, Chain]] = []
    for edits in range(MAX_EDITS + 1):
        candidates = []
        # after n edits the diagonals of the parity of n are reachable (Myers 1986, An O(ND) difference
        # algorithm)
        for diagonal in range(-edits, edits + 1, 2):
            above, below = reach.get(diagonal + 1), reach.get(diagonal - 1)
            # a step down inserts an item of b, a step right deletes an item of a; take the one that is
            # further
            if below is None or (above is not None and below[0] < above[0]):
                x, path = above or (a_from, None)
            else:
                x, path = below[0] + 1, below[1]
            shift = b_from - a_from - diagonal
            start = x
            while x < a_to and x + shift < b_to and a[x] == b[x + shift]:
                x += 1
            if x > start:
                path = (path, (start, start + shift, x - start))
            if x >= a_to and x + shift >= b_to:
                return path, (a_to, b_to)
            reach[diagonal] = (x, path)
            if x <= a_to and x + shift <= b_to:
                candidates.append((x, x + shift, path))
    x, y, path = max(candidates, key=lambda each: each[0] + each[1], default=(a_from, b_from, None))
    return path, (x, y)


def _cuts(a: Sequence[int], b: Sequence[int], ranges: Range) -> list[tuple[int, int]]:
    """Return pairs of items, or of starts of runs, that occur once in both ranges."""
    a_from, a_to, b_from, b_to = ranges
    for length in RUNS:
        unique_a, unique_b = _unique_runs(a, a_from, a_to, length), _unique_runs(b, b_from, b_to, length)
        common = [(start, unique_b[run]) for run, start in unique_a.items() if run in unique_b]
        if common:
            return rising(sorted(common))
    return []


def _unique_runs(items: Sequence[int], start: int, end: int, length: int) -> dict[tuple[int, ...], int]:
    """Return the starts of the runs that occur once in a range."""
    runs = [tuple(items[index : index + length]) for index in range(start, end - length + 1)]
    counts = Counter(runs)
    return {run: index for index, run in enumerate(runs, start) if counts[run] == 1}


def rising(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return a longest subsequence of pairs whose second indices increase.

    :param pairs: sorted by the first index.
    """
    # patience sorting: O(n log n)
    ends: list[int] = []  # the smallest last index of an increasing subsequence, by its length minus one
    chains: list[Chain] = []
    for index_a, index_b in pairs:
        position = bisect_left(ends, index_b)
        ends[position : position + 1] = [index_b]
        chains[position : position + 1] = [
            (chains[position - 1] if position else None, (index_a, index_b, 1))
        ]
    return [(index_a, index_b) for index_a, index_b, _ in _links(chains[-1] if chains else None)][::-1]


def _links(chain: Chain) -> Iterator[tuple[int, int, int]]:
    """Yield the runs of a chain from the last to the first."""
    while chain is not None:
        chain, run = chain
        yield run


def take_equal(
    items_a: list[Item],
    items_b: list[Item],
    key: Callable[[Item], Hashable],
    key_b: Callable[[Item], Hashable] | None = None,
) -> list[tuple[Item, Item]]:
    """Remove the items with equal keys from two lists and return them as pairs in order.

    :param key: returns the key of an item.
    :param key_b: returns the key of an item of the second list; None: the same function.
    """
    partners: dict[Hashable, deque[Item]] = defaultdict(deque)
    for item in items_b:
        partners[(key_b or key)(item)].append(item)
    pairs = [(item, queue.popleft()) for item in items_a if (queue := partners[key(item)])]
    drop_pairs(pairs, items_a, items_b)
    return pairs


def drop_pairs(pairs: Sequence[tuple[Item, Item]], items_a: list[Item], items_b: list[Item]) -> None:
    """Remove the items of pairs from two lists."""
    for run, items in enumerate((items_a, items_b)):
        paired = {pair[run] for pair in pairs}
        items[:] = [item for item in items if item not in paired]
