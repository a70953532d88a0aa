"""Planner calls whose result comes from elsewhere than a planner, or comes late."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.service import CANCELLED_TEXT, PlanCall, PlanningService, PlanRequest


class EndedCall(PlanCall):
    """A call that has a result from the start."""

    def __init__(self, service: PlanningService, request: PlanRequest, result: PlanResult) -> None:
        super().__init__(service, request)
        self._result = result
        self._done.set()


class DelayedCall(PlanCall):
    """A call whose result is delivered late.

    :param call: the call that has the result.
    :param is_due: returns whether the result may be delivered.
    """

    def __init__(self, service: PlanningService, call: PlanCall, is_due: Callable[[], bool]) -> None:
        super().__init__(service, call.request)
        self._call, self._is_due = call, is_due

    @property
    def result(self) -> PlanResult | None:
        """The result; None before the end of the delay."""
        return self._result or (self._call.result if self._is_due() else None)

    def wait(self, timeout: float | None = None) -> PlanResult | None:
        """Return the result; None before the end of the delay, or after the timeout."""
        # a wait for the end of the delay would be endless, since this thread advances the run's clock
        return self._result or (self._call.wait(timeout) if self._is_due() else None)

    def cancel(self) -> None:
        if self.result is None:
            self._result = PlanResult(PlanStatus.CANCELLED, self.request.planner, message=CANCELLED_TEXT)
            self._call.cancel()
