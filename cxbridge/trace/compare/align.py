"""Alignment of two sequences: which item of one is which of the other, in order.

Short edits are found exactly (Myers' algorithm); ranges that have little in common are cut at items, or short
runs of items, that both have once (as "patience" diffs do), so the time grows with the length, not with its
square.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

MAX_EDITS: Final = 64
"""Up to so many insertions and deletions in a range are looked for exactly."""

RUNS: Final = (1, 3, 8)
"""Lengths of runs of items that are looked for as places to cut; longer ones are rarely there but unique."""

NONE: Final = -1

Range: TypeAlias = tuple[int, int, int, int]
"""Begin and end in the first sequence, begin and end in the second."""


def align(a: Sequence[int], b: Sequence[int]) -> array[int]:
    """Return for each item of ``a`` the index of its partner in ``b``, -1 for none; partners are equal.

    The partners' indices grow.
    """
    partners = array("q", [NONE]) * len(a)
    stack: list[Range] = [(0, len(a), 0, len(b))]
    while stack:
        among = _trim(a, b, stack.pop(), partners)
        a_from, a_to, b_from, b_to = among
        if a_from == a_to or b_from == b_to:
            continue
        path = _furthest(a, b, among)
        cuts = [] if path.ends else _cuts(a, b, among)
        if cuts:
            last_a, last_b = a_from, b_from
            for one, other in cuts:
                partners[one] = other
                stack.append((last_a, one, last_b, other))
                last_a, last_b = one + 1, other + 1
            stack.append((last_a, a_to, last_b, b_to))
        elif path.ends or path.worthwhile(a_from, b_from):
            for one, other, length in path.runs:
                _pair(partners, one, other, length)
            if not path.ends:
                stack.append((path.a_to, a_to, path.b_to, b_to))
    return partners


@dataclass(frozen=True, slots=True)
class _Path:
    """How far a few edits lead from the start of a range.

    :param runs: the equal runs: index, index, length.
    :param a_to: where it ends in the first sequence; ``b_to``: in the second.
    :param ends: whether it leads to the end of the range.
    """

    runs: list[tuple[int, int, int]]
    a_to: int
    b_to: int
    ends: bool

    def worthwhile(self, a_from: int, b_from: int) -> bool:
        """Whether most of what it passes is equal: else there is nothing in common to be found."""
        return 3 * sum(length for _, _, length in self.runs) > (self.a_to - a_from) + (self.b_to - b_from)


def _pair(partners: array[int], one: int, other: int, length: int) -> None:
    """Note that two runs of items are equal."""
    for offset in range(length):
        partners[one + offset] = other + offset


def _trim(a: Sequence[int], b: Sequence[int], among: Range, partners: array[int]) -> Range:
    """Pair what is equal at the start and at the end of a range; return the rest."""
    a_from, a_to, b_from, b_to = among
    while a_from < a_to and b_from < b_to and a[a_from] == b[b_from]:
        partners[a_from] = b_from
        a_from += 1
        b_from += 1
    while a_from < a_to and b_from < b_to and a[a_to - 1] == b[b_to - 1]:
        a_to -= 1
        b_to -= 1
        partners[a_to] = b_to
    return a_from, a_to, b_from, b_to


def _furthest(a: Sequence[int], b: Sequence[int], among: Range) -> _Path:
    """Return the path of fewest edits to the end of a range, or the one that leads furthest (Myers)."""
    a_from, a_to, b_from, b_to = among
    reach: dict[int, int] = {1: a_from}
    history: list[dict[int, int]] = []
    for edits in range(MAX_EDITS + 1):
        history.append(dict(reach))
        for diagonal in range(-edits, edits + 1, 2):
            at = _step(reach, diagonal, edits)
            other = at - a_from - diagonal + b_from
            while at < a_to and other < b_to and a[at] == b[other]:
                at += 1
                other += 1
            reach[diagonal] = at
            if at >= a_to and other >= b_to:
                return _Path(_walk_back(history, among, at, other), at, other, ends=True)
    inside = [
        (2 * at - a_from - diagonal + b_from, at, at - a_from - diagonal + b_from)
        for diagonal, at in reach.items()
        if (diagonal - MAX_EDITS) % 2 == 0 and at <= a_to and at - a_from - diagonal + b_from <= b_to
    ]
    if not inside:
        return _Path([], a_from, b_from, ends=False)
    _, at, other = max(inside)
    return _Path(_walk_back(history, among, at, other), at, other, ends=False)


def _step(reach: dict[int, int], diagonal: int, edits: int) -> int:
    """Return where an edit leads on a diagonal: an insertion from above it, or a deletion from below."""
    if _inserts(reach, diagonal, edits):
        return reach[diagonal + 1]
    return reach[diagonal - 1] + 1


def _inserts(reach: dict[int, int], diagonal: int, edits: int) -> bool:
    """Whether the further way onto a diagonal is an insertion."""
    if diagonal == -edits:
        return True
    return diagonal != edits and reach.get(diagonal - 1, NONE) < reach.get(diagonal + 1, NONE)


def _walk_back(
    history: list[dict[int, int]], among: Range, at: int, other: int
) -> list[tuple[int, int, int]]:
    """Return the equal runs on the way to a place, from the last to the first."""
    a_from, _, b_from, _ = among
    runs = []
    for edits in range(len(history) - 1, -1, -1):
        reach = history[edits]
        diagonal = (at - a_from) - (other - b_from)
        down = _inserts(reach, diagonal, edits)
        before = diagonal + 1 if down else diagonal - 1
        start = reach[before] if edits else a_from
        start_other = start - a_from - before + b_from if edits else b_from
        begin = (start if down else start + 1) if edits else a_from
        if at > begin:
            runs.append((begin, other - (at - begin), at - begin))
        at, other = start, start_other
    return runs


def _cuts(a: Sequence[int], b: Sequence[int], among: Range) -> list[tuple[int, int]]:
    """Return items that belong together, in order: those that both have once, or begins of such runs."""
    a_from, a_to, b_from, b_to = among
    for length in RUNS:
        ones = _once(a, a_from, a_to, length)
        others = _once(b, b_from, b_to, length)
        common = [
            (at, others[item]) for item, at in ones.items() if item in others and a[at] == b[others[item]]
        ]
        if common:
            return _rising(sorted(common))
    return []


def _once(items: Sequence[int], start: int, end: int, length: int) -> dict[int, int]:
    """Return the runs of items (longer ones by their hash) that come only once in a range, and where."""
    found: dict[int, int] = {}
    for at in range(start, end - length + 1):
        item = items[at] if length == 1 else hash(tuple(items[at : at + length]))
        found[item] = NONE if item in found else at
    return {item: at for item, at in found.items() if at != NONE}


def _rising(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return a longest part of the pairs whose second indices grow, as the first do."""
    ends: list[int] = []  # the smallest last index of a rising part, by its length less one
    at_end: list[int] = []
    before: list[int] = []
    for number, (_, other) in enumerate(pairs):
        place = bisect_left(ends, other)
        before.append(at_end[place - 1] if place else NONE)
        if place == len(ends):
            ends.append(other)
            at_end.append(number)
        else:
            ends[place], at_end[place] = other, number
    chosen = []
    number = at_end[-1] if at_end else NONE
    while number != NONE:
        chosen.append(pairs[number])
        number = before[number]
    return chosen[::-1]
