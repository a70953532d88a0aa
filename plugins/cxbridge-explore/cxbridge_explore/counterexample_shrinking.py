"""Finds the shortest path of choices on which a property is still violated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Final

from cxbridge_explore.counterexample_playing import Played, Wanted, wanted

_ALL_SUBSETS: Final = 6
"""Up to this many choices are tried in all combinations."""

PlayWanted = Callable[[Sequence[Wanted]], Played]
"""Plays a run with some choices."""


def shrunk(choices: Sequence[Wanted], name: str, play: PlayWanted) -> Played | None:
    """Return a run with as few choices as possible that violates a property; of those, the earliest.

    :param choices: those of a run that violates it.
    :param name: of the property.
    :returns: None when not even the run with all of them does.
    """
    tried: dict[frozenset[Wanted], Played] = {}

    def violates(some: Sequence[Wanted]) -> Played | None:
        key = frozenset(some)
        if key not in tried:
            tried[key] = play(some)
        return tried[key] if tried[key].violation(name) is not None else None

    if len(choices) > _ALL_SUBSETS:
        choices = _without_needless(choices, lambda some: violates(some) is not None)
    for size in range(min(len(choices), _ALL_SUBSETS) + 1):
        found = [run for some in combinations(choices, size) if (run := violates(some)) is not None]
        if found:
            return min(found, key=lambda run: (len(wanted(run.choices)), _seconds(run, name)))
    return violates(choices)


def _seconds(run: Played, name: str) -> float:
    violation = run.violation(name)
    return violation.seconds if violation is not None else 0.0


def _without_needless(
    choices: Sequence[Wanted], violates: Callable[[Sequence[Wanted]], bool]
) -> list[Wanted]:
    """Return choices none of which can be left out: Zeller's delta debugging, by halves, quarters ..."""
    rest = list(choices)
    parts = 2
    while len(rest) > 1:
        size = -(-len(rest) // parts)
        for start in range(0, len(rest), size):
            smaller = rest[:start] + rest[start + size :]
            if violates(smaller):
                rest, parts = smaller, max(parts - 1, 2)
                break
        else:
            if size == 1:
                break
            parts = min(parts * 2, len(rest))
    return rest
