"""Finds the shortest path of choices that violates a property.

Delta debugging finds a path without needless choices, which may not be the shortest. So it only reduces long
paths; then all subsets of the remaining choices are tried, the smallest first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Final

from cxbridge_explore.counterexample_playing import NthChoice, PlayedRun, unusual_choices

_MAX_CHOICES: Final = 6  # limit of choices whose subsets are all tried: at most 64 runs

PlayChoices = Callable[[Sequence[NthChoice]], PlayedRun]  # plays a run with these choices


def shrink(choices: Sequence[NthChoice], name: str, play: PlayChoices) -> PlayedRun | None:
    """Return the run with the fewest choices that violates a property; among equals, the earliest violation.

    :param choices: the unusual choices of a failing run.
    :param name: the name of the property.
    :param play: plays a run with some of the choices.
    :returns: None if the run with all choices does not violate the property.
    """
    tried: dict[frozenset[NthChoice], PlayedRun] = {}

    def violating_run(subset: Sequence[NthChoice]) -> PlayedRun | None:
        key = frozenset(subset)
        if key not in tried:
            tried[key] = play(subset)
        return tried[key] if tried[key].violation(name) is not None else None

    if len(choices) > _MAX_CHOICES:
        choices = _minimize(choices, lambda subset: violating_run(subset) is not None)
    for size in range(min(len(choices), _MAX_CHOICES) + 1):
        violating_runs = [
            run for subset in combinations(choices, size) if (run := violating_run(subset)) is not None
        ]
        if violating_runs:
            return min(
                violating_runs, key=lambda run: (len(unusual_choices(run.choices)), _seconds(run, name))
            )
    return violating_run(choices)


def _seconds(run: PlayedRun, name: str) -> float:
    """Return the time of the violation of a property."""
    violation = run.violation(name)
    return violation.seconds if violation is not None else 0.0


def _minimize(
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
