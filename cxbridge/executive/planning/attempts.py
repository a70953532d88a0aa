"""Successive attempts of planners at a problem: time limits and results."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from cxbridge.executive.planning.planner import Planner, PlanResult, PlanStatus
from cxbridge.executive.planning.registry import AUTO, Choice, more_planners

# The share of the remaining time for each planner except the last one.
_SHARE: Final = 0.6


class Attempts:
    """The results of a call's planners so far.

    :param requested: the requested planner, or ``auto``.
    """

    def __init__(self, requested: str) -> None:
        self._requested = requested
        self._choice = Choice((), ())
        self._results: list[PlanResult] = []

    def begin(self, choice: Choice) -> None:
        """Set the planners to try."""
        self._choice = choice

    def shares(self) -> Iterator[tuple[Planner, float]]:
        """Yield the planners in order, with their share of the remaining time."""
        planners = self._choice.planners
        for planner in planners[:-1]:
            yield planner, _SHARE
        yield planners[-1], 1.0

    def is_decisive(self, planner: Planner, result: PlanResult) -> bool:
        """Add a result; return whether it ends the call."""
        self._results.append(result)
        proved = result.status is PlanStatus.NO_PLAN and planner.proves
        return result.status is PlanStatus.PLANNED or proved or self._requested != AUTO

    def explained(self, result: PlanResult) -> PlanResult:
        """Return the decisive result, with the reasons for the choice of its planner."""
        if self._requested != AUTO:
            return result
        failures = (failed.message for failed in self._results[:-1])
        reasons = (result.why, *self._choice.reasons, *failures)
        return replace(result, why="; ".join(filter(None, reasons)))

    def summary(self) -> PlanResult:
        """Return the result after all planners failed."""
        messages = "; ".join(result.message for result in self._results)
        # a proof of "no plan" counts least: an incomplete planner proves nothing when others have failed
        for status in (PlanStatus.TIMEOUT, PlanStatus.FAILED, PlanStatus.NO_PLAN):
            for result in self._results:
                if result.status is status:
                    return self.explained(replace(result, message=messages))
        return self._results[-1]

    @property
    def advice(self) -> str:
        """The advice after a timeout, as the end of a sentence."""
        suitable = [planner.name for planner in self._choice.planners]
        # the planner without a result is the one that the timeout has ended
        tried = suitable[: max(1, len(self._results)) + 1]
        text = f" (tried: {', '.join(tried)})" if suitable else ""
        alternative = ""
        if self._requested != AUTO:
            alternative = f", or try the planner {AUTO}"
        elif command := more_planners():
            alternative = f", or install more planners: {command}"
        elif self._choice.absent:
            alternative = f", or install one of {', '.join(self._choice.absent)}"
        return f"{text}: give more time{alternative}"
