"""The attempts of a call's planners at a problem, and the result of the call.

A call for a named planner has one attempt. A call for ``auto`` tries all suitable planners in turn, until a
planner has a plan or proves that there is none.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from cxbridge_planning.planner import Planner, PlanResult, PlanStatus
from cxbridge_planning.registry import AUTO, PlannerChoice

# The order in which the results of failed planners count: NO_PLAN counts least, because these planners prove
# nothing by it, while a failed planner might have found a plan.
_STATUS_ORDER: Final = (PlanStatus.TIMEOUT, PlanStatus.FAILED, PlanStatus.NO_PLAN)


class Attempts:
    """The attempts of one call.

    :param requested_planner: the name of the requested planner, or ``auto``.
    :ivar choice: the planners to try, once the call has chosen them.
    """

    def __init__(self, requested_planner: str) -> None:
        self._requested_planner = requested_planner
        self.choice = PlannerChoice((), ())
        self._results: list[PlanResult] = []

    def add_result(self, planner: Planner, result: PlanResult) -> bool:
        """Add a result; return whether it ends the call."""
        self._results.append(result)
        is_proof = result.status is PlanStatus.NO_PLAN and planner.proves
        return result.status is PlanStatus.PLANNED or is_proof or self._requested_planner != AUTO

    def with_reasons(self, result: PlanResult) -> PlanResult:
        """Return a result with the reasons why ``auto`` chose its planner; unchanged for a named planner."""
        if self._requested_planner != AUTO:
            return result
        failures = [failed.message for failed in self._results[:-1]]
        reasons = filter(None, (result.why, *self.choice.reasons, *failures))
        return replace(result, why="; ".join(reasons))

    def final_result(self) -> PlanResult:
        """Return the result after all planners failed."""
        decisive_result = min(self._results, key=lambda result: _STATUS_ORDER.index(result.status))
        return self.with_reasons(
            replace(decisive_result, message="; ".join(result.message for result in self._results))
        )

    @property
    def advice(self) -> str:
        """The advice after a timeout, as the end of a sentence."""
        names = [planner.name for planner in self.choice.planners]
        tried_names = names[: len(self._results) + 1]  # the planner that the timeout has ended has no result
        tried_text = f" (tried: {', '.join(tried_names)})" if names else ""
        if self._requested_planner != AUTO:
            return f"{tried_text}: give more time, or try the planner {AUTO}"
        missing_names = ", ".join(self.choice.unavailable_names)
        advice = f", or install one of {missing_names}" if missing_names else ""
        return f"{tried_text}: give more time{advice}"
