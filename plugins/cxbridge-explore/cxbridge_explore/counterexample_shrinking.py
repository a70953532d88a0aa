"""Finds the shortest path of choices that violates a property.

Delta debugging finds a path without needless choices, but maybe not the shortest. So it only reduces long
paths, and of the remaining choices all subsets are tried, the smallest first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Final

from cxbridge_explore.counterexample_playing import NthChoice, PlayedRun, unusual_choices

_ALL_SUBSETS: Final = 6  # limit of choices for trying all subsets, at most 64 runs

PlayChoices = Callable[[Sequence[NthChoice]], PlayedRun]  # plays a run with these choices


def shrunk(choices: Sequence[NthChoice], name: str, play: PlayChoices) -> PlayedRun | None:
    """Return the run with the fewest choices that violates a property; of equal runs, the earliest violation.

    :param choices: the unusual choices of a failing run.
    :param name: the property.
    :returns: None if the run with all choices does not violate the property.
    """
    tried: dict[frozenset[NthChoice], PlayedRun] = {}

    def violates(subset: Sequence[NthChoice]) -> PlayedRun | None:
        key = frozenset(subset)
        if key not in tried:
            tried[key] = play(subset)
        return tried[key] if tried[key].violation(name) is not None else None

    if len(choices) > _ALL_SUBSETS:
        choices = _minimized(choices, lambda subset: violates(subset) is not None)
    for size in range(min(len(choices), _ALL_SUBSETS) + 1):
        violating_runs = [
            run for subset in combinations(choices, size) if (run := violates(subset)) is not None
        ]
        if violating_runs:
            return min(
                violating_runs, key=lambda run: (len(unusual_choices(run.choices)), _seconds(run, name))
            )
    return violates(choices)


def _seconds(run: PlayedRun, name: str) -> float:
    violation = run.violation(name)
    return violation.seconds if violation is not None else 0.0


def _minimized(
    choices: Sequence[NthChoice], violates: Callable[[Sequence[NthChoice]], bool]
) -> list[NthChoice]:
    """Remove choices until none can be left out: Zeller's delta debugging, by halves, quarters and so on."""
    remaining = list(choices)
    chunks = 2
    while len(remaining) > 1:
        size = -(-len(remaining) // chunks)
        for start in range(0, len(remaining), size):
            smaller = remaining[:start] + remaining[start + size :]
            if violates(smaller):
                remaining, chunks = smaller, max(chunks - 1, 2)
                break
        else:
            if size == 1:
                break
            chunks = min(chunks * 2, len(remaining))
    return remaining
