"""Faults of planners that a program decides on: a call gets no plan, fails, or gets its plan late."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest

FAULTS: Final = "planning.faults"
"""The name of a program's :data:`ChooseFault` among the additions to a run."""

ChooseFault = Callable[[str, str], tuple[str, float]]
"""Gets the environment and the name of the problem; returns the status of a call without a plan, else an
empty text, and the seconds by which the plan is late."""


class FaultyPlanning(PlanningService):
    """Makes plans, unless a program decides on a fault.

    :param env: the environment that requests plans.
    :param now_us: returns the time of the run.
    """

    def __init__(self, choose_fault: ChooseFault, env: str, now_us: Callable[[], int]) -> None:
        super().__init__()
        self._choose_fault, self._env, self._now_us = choose_fault, env, now_us

    def call(self, request: PlanRequest) -> PlanCall:
        """Start making a plan, unless the program decides on a fault."""
        status, delay_s = self._choose_fault(self._env, request.problem.name)
        if status:
            return _CallWithoutPlan(self, request, PlanStatus(status))
        if delay_s:
            due_us = self._now_us() + round(delay_s * MICROSECONDS)
            return _LateCall(self, request, super().call(request), lambda: self._now_us() >= due_us)
        return super().call(request)


class _CallWithoutPlan(PlanCall):
    """A call that has ended at once, without a plan."""

    def __init__(self, service: PlanningService, request: PlanRequest, status: PlanStatus) -> None:
        super().__init__(service, request)
        self._result = PlanResult(status, request.planner, message="the world has chosen this result")
        self._done.set()


class _LateCall(PlanCall):
    """A call whose plan is delivered late."""

    def __init__(
        self, service: PlanningService, request: PlanRequest, call: PlanCall, is_due: Callable[[], bool]
    ) -> None:
        super().__init__(service, request)
        self._call, self._is_due, self._cancelled = call, is_due, False

    @property
    def result(self) -> PlanResult | None:
        """The result; None before the end of the delay."""
        return self._call.result if self._cancelled or self._is_due() else None

    def wait(self, timeout: float | None = None) -> PlanResult | None:
        """Return the result; None before the end of the delay."""
        # a wait for the end of the delay would be endless, since this thread advances the run's clock
        return self._call.wait(timeout) if self._cancelled or self._is_due() else None

    def cancel(self) -> None:
        self._cancelled = True
        self._call.cancel()
