"""Choices about planners: no plan, a failure, or a late plan."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.executive.planning import PlanCall, PlanningService, PlanRequest, PlanResult
from cxbridge.executive.planning.planner import PlanStatus
from cxbridge_explore.worldmodel.model import PlannerModel
from cxbridge_explore.worlds.asking import Asking, fault, unless
from cxbridge_explore.worlds.points import ChoiceKind

_NO_PLAN, _FAILS, _LATE = "no plan", "fails", "late"


class ChosenPlanning(PlanningService):
    """Makes plans unless the world decides on a fault.

    :param asking: returns the chooser; called when a plan is requested.
    :param env: the environment that requests plans.
    """

    def __init__(self, planner: PlannerModel, asking: Callable[[], Asking], env: str) -> None:
        super().__init__()
        self._planner, self._asking, self._env = planner, asking, env
        faults = ((_NO_PLAN, planner.none), (_FAILS, planner.fails), (_LATE, planner.late))
        self._options = unless("plans", *(fault(name, weight) for name, weight in faults if weight))

    def call(self, request: PlanRequest) -> PlanCall:
        """Start making a plan, unless the world decides on a fault."""
        ask = self._asking()
        if len(self._options) == 1:
            return super().call(request)
        subject = f"{self._env}: plan for {request.problem.name}"
        chosen = ask(ChoiceKind.PLANNER, subject, self._options).name
        if chosen == _LATE:
            due = ask.seconds + self._planner.delay
            return _HeldCall(self, request, super().call(request), lambda: ask.seconds >= due)
        if chosen == _NO_PLAN:
            return _SettledCall(self, request, PlanStatus.NO_PLAN)
        if chosen == _FAILS:
            return _SettledCall(self, request, PlanStatus.FAILED)
        return super().call(request)


class _SettledCall(PlanCall):
    """A call without a plan."""

    def __init__(self, service: PlanningService, request: PlanRequest, status: PlanStatus) -> None:
        super().__init__(service, request)
        self._settled = PlanResult(status, request.planner, message="the world has decided so")

    @property
    def result(self) -> PlanResult | None:
        return self._settled

    def wait(self, timeout: float | None = None) -> PlanResult | None:  # noqa: ARG002 - the result is known at once
        return self._settled


class _HeldCall(PlanCall):
    """A call whose plan is delivered late."""

    def __init__(
        self, service: PlanningService, request: PlanRequest, call: PlanCall, is_due: Callable[[], bool]
    ) -> None:
        super().__init__(service, request)
        self._call, self._is_due, self._cancelled = call, is_due, False

    @property
    def result(self) -> PlanResult | None:
        """The result; None before its time."""
        return self._call.result if self._cancelled or self._is_due() else None

    def wait(self, timeout: float | None = None) -> PlanResult | None:
        """Return the result, or None before its time.

        It does not wait, since the run's clock must advance.
        """
        return self._call.wait(timeout) if self._cancelled or self._is_due() else None

    def cancel(self) -> None:
        self._cancelled = True
        self._call.cancel()
