"""The attempts of a call's planners at a problem: shares of the time, and the result of the call.

A call for a named planner has one attempt. A call for ``auto`` tries all suitable planners in turn, until a
planner has a plan or proves that there is none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from cxbridge_planning.planner import Planner, PlanResult, PlanStatus
from cxbridge_planning.registry import AUTO, PlannerChoice

# The share of the remaining time for each planner except the last planner.
_TIME_SHARE: Final = 0.6


class Attempts:
    """The attempts of one call.

    :param requested: the requested planner, or ``auto``.
    :ivar choice: the planners to try, once the call has chosen them.
    """

    def __init__(self, requested: str) -> None:
        self._requested = requested
        self.choice = PlannerChoice((), ())
        self._results: list[PlanResult] = []

    def shares(self) -> Iterator[tuple[Planner, float]]:
        """Yield each planner in order, with its share of the remaining time."""
        planners = self.choice.planners
        for planner in planners[:-1]:
            yield planner, _TIME_SHARE
        yield planners[-1], 1.0

    def add_result(self, planner: Planner, result: PlanResult) -> bool:
        """Add a result; return whether it ends the call."""
        self._results.append(result)
        proved = result.status is PlanStatus.NO_PLAN and planner.proves
        return result.status is PlanStatus.PLANNED or proved or self._requested != AUTO

    def with_reasons(self, result: PlanResult) -> PlanResult:
        """Return a result with the reasons why ``auto`` chose its planner."""
        if self._requested != AUTO:
            return result
        failures = (failed.message for failed in self._results[:-1])
        reasons = (result.why, *self.choice.reasons, *failures)
        return replace(result, why="; ".join(filter(None, reasons)))

    def final_result(self) -> PlanResult:
        """Return the result after all planners failed."""
        messages = "; ".join(result.message for result in self._results)
        # NO_PLAN counts least: these planners prove nothing by it, while a failed planner might have found a
        # plan
        for status in (PlanStatus.TIMEOUT, PlanStatus.FAILED, PlanStatus.NO_PLAN):
            for result in self._results:
                if result.status is status:
                    return self.with_reasons(replace(result, message=messages))
        return self._results[-1]

    @property
    def advice(self) -> str:
        """The advice after a timeout, as the end of a sentence."""
        suitable = [planner.name for planner in self.choice.planners]
        # the timeout has ended the planner without a result
        tried = suitable[: max(1, len(self._results)) + 1]
        text = f" (tried: {', '.join(tried)})" if suitable else ""
        alternative = ""
        if self._requested != AUTO:
            alternative = f", or try the planner {AUTO}"
        elif self.choice.not_installed_names:
            alternative = f", or install one of {', '.join(self.choice.not_installed_names)}"
        return f"{text}: give more time{alternative}"
