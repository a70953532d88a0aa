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
"""The maximal number of insertions and deletions in a range for the exact algorithm."""

# longer runs are more likely unique, but less likely common
RUNS: Final = (1, 3, 8)
"""The lengths of runs of items at which ranges are split."""

NONE: Final = -1

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
        while a_from < a_to and b_from < b_to and a[a_from] == b[b_from]:
            pairs.append((a_from, b_from))
            a_from, b_from = a_from + 1, b_from + 1
        while a_from < a_to and b_from < b_to and a[a_to - 1] == b[b_to - 1]:
            a_to, b_to = a_to - 1, b_to - 1
            pairs.append((a_to, b_to))
        if a_from == a_to or b_from == b_to:
            continue
        among = (a_from, a_to, b_from, b_to)
        path, end = _furthest(a, b, among)
        cuts = [] if end == (a_to, b_to) else _cuts(a, b, among)
        if not cuts:
            cuts = [(one + i, other + i) for one, other, length in _links(path) for i in range(length)]
            if end == (a_to, b_to):
                pairs += cuts
            # otherwise the equal items are coincidences
            elif 3 * len(cuts) > end[0] - a_from + end[1] - b_from:
                pairs += cuts
                stack.append((end[0], a_to, end[1], b_to))
            continue
        pairs += cuts
        begins = [(a_from, b_from), *((one + 1, other + 1) for one, other in cuts)]
        for (one, other), (next_one, next_other) in zip(begins, [*cuts, (a_to, b_to)], strict=True):
            stack.append((one, next_one, other, next_other))
    return sorted(pairs)


def _furthest(a: Sequence[int], b: Sequence[int], among: Range) -> tuple[Chain, tuple[int, int]]:
    """Return the equal runs on the path with the fewest edits, and the end of the path."""
    a_from, a_to, b_from, b_to = among
    reach: dict[int, tuple[int, Chain]] = {1: (a_from, None)}
    inside: list[tuple[int, int, Chain]] = []
    for edits in range(MAX_EDITS + 1):
        inside = []
        for diagonal in range(-edits, edits + 1, 2):
            above, below = reach.get(diagonal + 1), reach.get(diagonal - 1)
            if below is None or (above is not None and below[0] < above[0]):
                at, path = above or (a_from, None)
            else:
                at, path = below[0] + 1, below[1]
            shift = b_from - a_from - diagonal
            begin = at
            while at < a_to and at + shift < b_to and a[at] == b[at + shift]:
                at += 1
            if at > begin:
                path = (path, (begin, begin + shift, at - begin))
            if at >= a_to and at + shift >= b_to:
                return path, (a_to, b_to)
            reach[diagonal] = (at, path)
            if at <= a_to and at + shift <= b_to:
                inside.append((at, at + shift, path))
    at, other, path = max(inside, key=lambda each: each[0] + each[1], default=(a_from, b_from, None))
    return path, (at, other)


def _cuts(a: Sequence[int], b: Sequence[int], among: Range) -> list[tuple[int, int]]:
    """Return pairs of items, or of starts of runs, that occur once in both ranges."""
    a_from, a_to, b_from, b_to = among
    for length in RUNS:
        ones, others = _once(a, a_from, a_to, length), _once(b, b_from, b_to, length)
        common = [(at, others[run]) for run, at in ones.items() if run in others]
        if common:
            return rising(sorted(common))
    return []


def _once(items: Sequence[int], start: int, end: int, length: int) -> dict[tuple[int, ...], int]:
    """Return the starts of the runs that occur once in a range."""
    runs = [tuple(items[at : at + length]) for at in range(start, end - length + 1)]
    counts = Counter(runs)
    return {run: at for at, run in enumerate(runs, start) if counts[run] == 1}


def rising(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return a longest subsequence of pairs whose second indices increase."""
    ends: list[int] = []  # the smallest last index of an increasing subsequence, by its length minus one
    chains: list[Chain] = []
    for one, other in pairs:
        place = bisect_left(ends, other)
        ends[place : place + 1] = [other]
        chains[place : place + 1] = [(chains[place - 1] if place else None, (one, other, 1))]
    return [(one, other) for one, other, _ in _links(chains[-1] if chains else None)][::-1]


def _links(chain: Chain) -> Iterator[tuple[int, int, int]]:
    """Yield the runs of a chain from the last to the first."""
    while chain is not None:
        chain, run = chain
        yield run


def take_equal(
    ours: list[Item],
    theirs: list[Item],
    key: Callable[[Item], Hashable],
    other_key: Callable[[Item], Hashable] | None = None,
) -> list[tuple[Item, Item]]:
    """Remove the items with equal keys from two lists and return them as pairs in order.

    :param key: the key of an item; ``other_key``: of an item of the second list, None for the same function.
    """
    left: dict[Hashable, deque[Item]] = defaultdict(deque)
    for item in theirs:
        left[(other_key or key)(item)].append(item)
    pairs = [(item, found.popleft()) for item in ours if (found := left[key(item)])]
    drop_pairs(pairs, ours, theirs)
    return pairs


def drop_pairs(pairs: Sequence[tuple[Item, Item]], ours: list[Item], theirs: list[Item]) -> None:
    """Remove the items of pairs from two lists."""
    for run, items in enumerate((ours, theirs)):
        gone = {pair[run] for pair in pairs}
        items[:] = [item for item in items if item not in gone]
