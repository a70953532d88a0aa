"""Alignment of two sequences: pairs of equal items in order.

Myers' algorithm (An O(ND) difference algorithm, 1986) aligns sequences with few edits exactly. ``difflib``
aligns sequences with little in common, but loses most pairs when many edits are scattered among repetitions,
such as firings of a few rules.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Hashable, Sequence
from difflib import SequenceMatcher
from itertools import takewhile
from operator import eq, itemgetter
from typing import Final, TypeAlias, TypeVar

WINDOW_SIZE: Final = 2000
"""The number of items of each sequence that are aligned at once; difflib's time grows with its square."""

MAX_EDITS: Final = 64
"""The maximum number of edits for the exact algorithm, whose time grows with its square."""

MISSING: Final = -1
"""The index of a missing item."""

Item = TypeVar("Item", bound=Hashable)
Block: TypeAlias = tuple[int, int, int]
"""Two starts and the number of equal items."""


def align(a: Sequence[int], b: Sequence[int]) -> list[Block]:
    """Return the blocks of equal items, in order in both sequences.

    The first and the last block, at the ends of the sequences, may be empty.
    """
    # similar runs consist mostly of equal starts and ends
    start_a = start_b = sum(takewhile(bool, map(eq, a, b)))
    end_a, end_b = len(a), len(b)
    while end_a > start_a and end_b > start_b and a[end_a - 1] == b[end_b - 1]:
        end_a, end_b = end_a - 1, end_b - 1
    blocks = [(0, 0, start_a)]
    while start_a < end_a and start_b < end_b:
        window_a = a[start_a : min(start_a + WINDOW_SIZE, end_a)]
        window_b = b[start_b : min(start_b + WINDOW_SIZE, end_b)]
        window_blocks = [
            (start_a + index_a, start_b + index_b, size)
            for index_a, index_b, size in _find_blocks(window_a, window_b)
        ]
        # the last items may have better partners after the window
        blocks += window_blocks[: (len(window_blocks) + 1) // 2]
        if window_blocks:
            last_a, last_b, size = blocks[-1]
            start_a, start_b = last_a + size, last_b + size
        else:
            start_a, start_b = start_a + len(window_a), start_b + len(window_b)
    return [*blocks, (end_a, end_b, len(a) - end_a)]


def _find_blocks(a: Sequence[int], b: Sequence[int]) -> Sequence[Block]:
    """Return blocks of equal items in order.

    The exact algorithm finds the blocks up to :data:`MAX_EDITS` edits from the start. If these blocks are
    few, difflib finds the blocks of the whole sequences.
    """
    # by diagonal, the index in a that a path has reached, and its equal blocks; as in Myers' paper, the first
    # entry is on the diagonal 1, from which a step down leads to the start
    reach: dict[int, tuple[int, tuple[Block, ...]]] = {1: (0, ())}
    for edits in range(MAX_EDITS + 1):
        # after n edits, paths are on the diagonals of the parity of n
        for diagonal in range(-edits, edits + 1, 2):
            above, below = (reach.get(neighbour, (-1, ())) for neighbour in (diagonal + 1, diagonal - 1))
            # a step down inserts an item of b, a step right deletes an item of a: the longer way wins
            first, blocks = above if below[0] < above[0] else (below[0] + 1, below[1])
            end = first
            while end < len(a) and end - diagonal < len(b) and a[end] == b[end - diagonal]:
                end += 1
            blocks = blocks if end == first else (*blocks, (first, first - diagonal, end - first))
            if end >= len(a) and end - diagonal >= len(b):
                return blocks
            reach[diagonal] = (end, blocks)
    candidates = [
        (2 * end - diagonal, blocks)  # the number of items of both sequences that the path has passed
        for diagonal, (end, blocks) in reach.items()
        if end <= len(a) and end - diagonal <= len(b)
    ]
    passed_count, blocks = max(candidates, key=itemgetter(0))
    # if at most two thirds of the items have a partner (chosen freely), their pairs are rather coincidences
    if 3 * sum(size for *_, size in blocks) > passed_count:
        return blocks
    # the last block is empty
    return SequenceMatcher(None, a, b, autojunk=False).get_matching_blocks()[:-1]


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
