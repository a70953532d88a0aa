"""Finds the shortest path of choices that violates a property."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Final

from cxbridge_explore.counterexample_playing import Played, Wanted, unusual_choices

_ALL_SUBSETS: Final = 6  # limit of choices for trying all subsets

PlayWanted = Callable[[Sequence[Wanted]], Played]  # plays a run with these choices


def shrunk(choices: Sequence[Wanted], name: str, play: PlayWanted) -> Played | None:
    """Return the run with the fewest choices that violates a property; of equal runs, the earliest violation.

    :param choices: the unusual choices of a failing run.
    :param name: the property.
    :returns: None if the run with all choices does not violate the property.
    """
    tried: dict[frozenset[Wanted], Played] = {}

    def violates(subset: Sequence[Wanted]) -> Played | None:
        key = frozenset(subset)
        if key not in tried:
            tried[key] = play(subset)
        return tried[key] if tried[key].violation(name) is not None else None

    if len(choices) > _ALL_SUBSETS:
        choices = _without_needless(choices, lambda subset: violates(subset) is not None)
    for size in range(min(len(choices), _ALL_SUBSETS) + 1):
        violating_runs = [
            run for subset in combinations(choices, size) if (run := violates(subset)) is not None
        ]
        if violating_runs:
            return min(
                violating_runs, key=lambda run: (len(unusual_choices(run.choices)), _seconds(run, name))
            )
    return violates(choices)


def _seconds(run: Played, name: str) -> float:
    violation = run.violation(name)
    return violation.seconds if violation is not None else 0.0


def _without_needless(
    choices: Sequence[Wanted], violates: Callable[[Sequence[Wanted]], bool]
) -> list[Wanted]:
    """Remove choices until none can be left out: Zeller's delta debugging, by halves, quarters and so on."""
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
