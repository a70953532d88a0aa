"""Finds the shortest path of choices that violates a property: all subsets are tried, the smallest first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

from cxbridge_explore.counterexample_playing import NthChoice, PlayedRun, unusual_choices

PlayChoices = Callable[[Sequence[NthChoice]], PlayedRun]  # plays a run with these choices


def shrink(choices: Sequence[NthChoice], name: str, play_choices: PlayChoices) -> PlayedRun | None:
    """Return a run that violates a property, with the fewest choices, and then with the earliest violation.

    :param choices: the unusual choices of a run that violates the property.
    :param name: the name of the property.
    :param play_choices: plays a run with some of the choices.
    :returns: None if the run with all choices does not violate the property.
    """
    for size in range(len(choices) + 1):
        runs = map(play_choices, combinations(choices, size))
        violating_runs = [run for run in runs if run.find_violation(name) is not None]
        if violating_runs:
            return min(
                violating_runs,
                key=lambda run: (len(unusual_choices(run.choices)), _violation_seconds(run, name)),
            )
    return None


def _violation_seconds(run: PlayedRun, name: str) -> float:
    """Return the time of the violation of a property, in seconds since the start of the run."""
    violation = run.find_violation(name)
    return violation.seconds if violation is not None else 0.0
