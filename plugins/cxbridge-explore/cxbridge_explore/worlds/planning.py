"""Choices about planners: a call gets no plan, fails, or gets its plan late."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.executive.planning import PlanCall, PlanningService, PlanRequest, PlanResult
from cxbridge.executive.planning.planner import PlanStatus
from cxbridge_explore.worldmodel.model import PlannerModel
from cxbridge_explore.worlds.points import ChoiceKind, RunChoices, fault, with_faults


class ChosenPlanning(PlanningService):
    """Makes plans unless the world decides on a fault.

    :param choices: returns the choices of the run. A function, since the service is made before the run.
    :param env: the environment that requests plans.
    """

    def __init__(self, planner: PlannerModel, choices: Callable[[], RunChoices], env: str) -> None:
        super().__init__()
        self._planner, self._choices, self._env = planner, choices, env
        faults = (("no plan", planner.none), ("fails", planner.fails), ("late", planner.late))
        self._options = with_faults("plans", *(fault(name, weight) for name, weight in faults if weight))

    def call(self, request: PlanRequest) -> PlanCall:
        """Start making a plan, unless the world decides on a fault."""
        if len(self._options) == 1:
            return super().call(request)
        choices = self._choices()
        subject = f"{self._env}: plan for {request.problem.name}"
        match choices.choose(ChoiceKind.PLANNER, subject, self._options).name:
            case "no plan":
                return _FailedCall(self, request, PlanStatus.NO_PLAN)
            case "fails":
                return _FailedCall(self, request, PlanStatus.FAILED)
            case "late":
                due = choices.seconds + self._planner.delay
                return _LateCall(self, request, super().call(request), lambda: choices.seconds >= due)
        return super().call(request)


class _FailedCall(PlanCall):
    """A call without a plan, over at once."""

    def __init__(self, service: PlanningService, request: PlanRequest, status: PlanStatus) -> None:
        super().__init__(service, request)
        self._result = PlanResult(status, request.planner, message="the world has chosen this result")

    @property
    def result(self) -> PlanResult | None:
        return self._result

    def wait(self, timeout: float | None = None) -> PlanResult | None:  # noqa: ARG002 - the result exists at once
        return self._result


class _LateCall(PlanCall):
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
        """Return the result, or None before its time."""
        # Waiting would never end: the delay is measured by the run's clock, which this thread advances.
        return self._call.wait(timeout) if self._cancelled or self._is_due() else None

    def cancel(self) -> None:
        self._cancelled = True
        self._call.cancel()
