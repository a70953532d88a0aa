"""Alignment of two sequences: pairs of equal items in order.

Myers' algorithm (An O(ND) difference algorithm, 1986) aligns ranges with few edits exactly. Ranges with
little in common are split at anchors: blocks of one or more items that occur once in both ranges, as in
"patience" diffs. The time thus grows with the length instead of its square.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any, Final, TypeAlias, TypeVar

MAX_EDITS: Final = 64
"""The maximum number of insertions and deletions in a range for the exact algorithm.

Its time grows with the square of this number.
"""

# tried in this order: longer blocks are more likely unique, but less likely common
BLOCK_LENGTHS: Final = (1, 3, 8)
"""The lengths of the blocks at which ranges are split, in items."""

MISSING: Final = -1
"""The index of a missing item."""

Item = TypeVar("Item", bound=Hashable)
Range: TypeAlias = tuple[int, int, int, int]
"""The start and end in the first sequence, then those in the second."""

BlockChain: TypeAlias = tuple[Any, tuple[int, int, int]] | None
"""A linked list of equal blocks, the last first. A link has the preceding chain, two starts and a length."""


def align(a: Sequence[int], b: Sequence[int]) -> list[tuple[int, int]]:
    """Return the pairs of indices of equal items; both indices increase."""
    pairs: list[tuple[int, int]] = []
    stack: list[Range] = [(0, len(a), 0, len(b))]
    while stack:
        a_from, a_to, b_from, b_to = stack.pop()
        # similar runs consist mostly of equal starts and ends, which cost nothing here
        while a_from < a_to and b_from < b_to and a[a_from] == b[b_from]:
            pairs.append((a_from, b_from))
            a_from, b_from = a_from + 1, b_from + 1
        while a_from < a_to and b_from < b_to and a[a_to - 1] == b[b_to - 1]:
            a_to, b_to = a_to - 1, b_to - 1
            pairs.append((a_to, b_to))
        if a_from == a_to or b_from == b_to:
            continue
        ranges = (a_from, a_to, b_from, b_to)
        path, end = _find_edit_path(a, b, ranges)
        # few edits: the exact path; many edits: split the ranges at anchors
        anchors = [] if end == (a_to, b_to) else _find_anchors(a, b, ranges)
        if not anchors:
            anchors = [
                (index_a + i, index_b + i)
                for index_a, index_b, length in _walk_backwards(path)
                for i in range(length)
            ]
            if end == (a_to, b_to):
                pairs += anchors
            # no anchors: the path so far counts if its pairs are more than a third of the items on it; fewer
            # pairs are coincidences
            elif 3 * len(anchors) > end[0] - a_from + end[1] - b_from:
                pairs += anchors
                stack.append((end[0], a_to, end[1], b_to))
            continue
        pairs += anchors
        starts = [(a_from, b_from), *((index_a + 1, index_b + 1) for index_a, index_b in anchors)]
        for (index_a, index_b), (next_a, next_b) in zip(starts, [*anchors, (a_to, b_to)], strict=True):
            stack.append((index_a, next_a, index_b, next_b))
    return sorted(pairs)


def _find_edit_path(a: Sequence[int], b: Sequence[int], ranges: Range) -> tuple[BlockChain, tuple[int, int]]:
    """Return the equal blocks on the path with the fewest edits, and the end of the path.

    The path ends early after :data:`MAX_EDITS` edits.
    """
    a_from, a_to, b_from, b_to = ranges
    # by diagonal: the index in a that a path has reached, and its equal blocks
    reach: dict[int, tuple[int, BlockChain]] = {1: (a_from, None)}
    candidates: list[tuple[int, int, BlockChain]] = []
    for edits in range(MAX_EDITS + 1):
        candidates = []
        # after n edits, Myers' algorithm reaches the diagonals of the parity of n
        for diagonal in range(-edits, edits + 1, 2):
            above, below = reach.get(diagonal + 1), reach.get(diagonal - 1)
            # a step down inserts an item of b, a step right deletes an item of a: the step that leads further
            # wins
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
    x, y, path = max(
        candidates, key=lambda candidate: candidate[0] + candidate[1], default=(a_from, b_from, None)
    )
    return path, (x, y)


def _find_anchors(a: Sequence[int], b: Sequence[int], ranges: Range) -> list[tuple[int, int]]:
    """Return pairs of starts of blocks that occur once in both ranges."""
    a_from, a_to, b_from, b_to = ranges
    for length in BLOCK_LENGTHS:
        unique_a, unique_b = (
            _find_unique_blocks(a, a_from, a_to, length),
            _find_unique_blocks(b, b_from, b_to, length),
        )
        common_starts = [(start, unique_b[block]) for block, start in unique_a.items() if block in unique_b]
        if common_starts:
            return longest_increasing(sorted(common_starts))
    return []


def _find_unique_blocks(
    items: Sequence[int], start: int, end: int, length: int
) -> dict[tuple[int, ...], int]:
    """Return the starts of the blocks that occur once in a range."""
    blocks = [tuple(items[index : index + length]) for index in range(start, end - length + 1)]
    counts = Counter(blocks)
    return {block: index for index, block in enumerate(blocks, start) if counts[block] == 1}


def longest_increasing(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return a longest subsequence of pairs whose second indices increase.

    :param pairs: sorted by the first index.
    """
    # patience sorting: O(n log n)
    ends: list[int] = []  # the smallest last index of an increasing subsequence, by its length minus one
    chains: list[BlockChain] = []
    for index_a, index_b in pairs:
        position = bisect_left(ends, index_b)
        # replaces the first end that is not smaller, or appends if there is none
        ends[position : position + 1] = [index_b]
        chains[position : position + 1] = [
            (chains[position - 1] if position else None, (index_a, index_b, 1))
        ]
    return [(index_a, index_b) for index_a, index_b, _ in _walk_backwards(chains[-1] if chains else None)][
        ::-1
    ]


def _walk_backwards(chain: BlockChain) -> Iterator[tuple[int, int, int]]:
    """Yield the blocks of a chain from the last to the first."""
    while chain is not None:
        chain, block = chain
        yield block


def pop_equal_pairs(
    items_a: list[Item],
    items_b: list[Item],
    key: Callable[[Item], Hashable],
    key_b: Callable[[Item], Hashable] | None = None,
) -> list[tuple[Item, Item]]:
    """Remove items with equal keys from two lists; return them as pairs in the order of the first list.

    :param key: returns the key of an item.
    :param key_b: returns the key of an item of the second list; None: the same function.
    """
    partners: dict[Hashable, deque[Item]] = defaultdict(deque)
    for item in items_b:
        partners[(key_b or key)(item)].append(item)
    pairs = [(item, queue.popleft()) for item in items_a if (queue := partners[key(item)])]
    remove_pairs(pairs, items_a, items_b)
    return pairs


def remove_pairs(pairs: Sequence[tuple[Item, Item]], items_a: list[Item], items_b: list[Item]) -> None:
    """Remove the items of pairs from two lists."""
    for run_index, items in enumerate((items_a, items_b)):
        paired_items = {pair[run_index] for pair in pairs}
        items[:] = [item for item in items if item not in paired_items]
