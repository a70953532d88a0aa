"""Finds the shortest path of choices that violates a property.

Delta debugging finds a path from which no choice can be left out, but which may not be the shortest.
Therefore delta debugging only shortens long paths. Then all subsets of the remaining choices are tried, the
smallest first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Final

from cxbridge_explore.counterexample_playing import NthChoice, PlayedRun, unusual_choices

_MAX_CHOICES: Final = 6  # limit of choices whose subsets are all tried: at most 64 runs

PlayChoices = Callable[[Sequence[NthChoice]], PlayedRun]  # plays a run with these choices


def shrink(choices: Sequence[NthChoice], name: str, play_choices: PlayChoices) -> PlayedRun | None:
    """Return a run that violates a property, with the fewest choices, and then with the earliest violation.

    :param choices: the unusual choices of a run that violates the property.
    :param name: the name of the property.
    :param play_choices: plays a run with some of the choices.
    :returns: None if the run with all choices does not violate the property.
    """
    tried_runs: dict[frozenset[NthChoice], PlayedRun] = {}

    def find_violating_run(subset: Sequence[NthChoice]) -> PlayedRun | None:
        key = frozenset(subset)
        if key not in tried_runs:
            tried_runs[key] = play_choices(subset)
        return tried_runs[key] if tried_runs[key].find_violation(name) is not None else None

    if len(choices) > _MAX_CHOICES:
        choices = _minimize(choices, lambda subset: find_violating_run(subset) is not None)
    for size in range(min(len(choices), _MAX_CHOICES) + 1):
        violating_runs = [
            run for subset in combinations(choices, size) if (run := find_violating_run(subset)) is not None
        ]
        if violating_runs:
            return min(
                violating_runs,
                key=lambda run: (len(unusual_choices(run.choices)), _violation_seconds(run, name)),
            )
    return find_violating_run(choices)


def _violation_seconds(run: PlayedRun, name: str) -> float:
    """Return the time of the violation of a property, in seconds since the start of the run."""
    violation = run.find_violation(name)
    return violation.seconds if violation is not None else 0.0


def _minimize(
    choices: Sequence[NthChoice], violates: Callable[[Sequence[NthChoice]], bool]
) -> list[NthChoice]:
    """Remove choices until none can be left out: Zeller's delta debugging, by halves, quarters and so on."""
    remaining = list(choices)
    chunk_count = 2
    while len(remaining) > 1:
        size = -(-len(remaining) // chunk_count)  # rounded up
        for start in range(0, len(remaining), size):
            smaller = remaining[:start] + remaining[start + size :]
            if violates(smaller):
                remaining, chunk_count = smaller, max(chunk_count - 1, 2)
                break
        else:
            if size == 1:
                break
            chunk_count = min(chunk_count * 2, len(remaining))
    return remaining
