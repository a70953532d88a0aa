"""Choices about planners: a call gets no plan, fails, or gets its plan late."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.executive.planning import PlanCall, PlanningService, PlanRequest, PlanResult
from cxbridge.executive.planning.planner import PlanStatus
from cxbridge_explore.worldmodel.model import PlannerModel
from cxbridge_explore.worlds.points import ChoiceKind, RunChoices, make_fault, make_options


class FaultyPlanning(PlanningService):
    """Makes plans, unless the world decides on a fault.

    :param planner: the possible faults.
    :param find_choices: returns the choices of the run, which are made after the service.
    :param env: the environment that requests plans.
    """

    def __init__(self, planner: PlannerModel, find_choices: Callable[[], RunChoices], env: str) -> None:
        super().__init__()
        self._planner, self._find_choices, self._env = planner, find_choices, env
        faults = (
            ("no plan", planner.no_plan_probability),
            ("fails", planner.failure_probability),
            ("late", planner.delay_probability),
        )
        self._options = make_options(
            "plans", *(make_fault(name, weight) for name, weight in faults if weight)
        )

    def call(self, request: PlanRequest) -> PlanCall:
        """Start making a plan, unless the world decides on a fault."""
        if len(self._options) == 1:
            return super().call(request)
        choices = self._find_choices()
        subject = f"{self._env}: plan for {request.problem.name}"
        match choices.choose(ChoiceKind.PLANNER, subject, self._options).name:
            case "no plan":
                return _CallWithoutPlan(self, request, PlanStatus.NO_PLAN)
            case "fails":
                return _CallWithoutPlan(self, request, PlanStatus.FAILED)
            case "late":
                due = choices.seconds + self._planner.delay_s
                return _LateCall(self, request, super().call(request), lambda: choices.seconds >= due)
        return super().call(request)


class _CallWithoutPlan(PlanCall):
    """A call that has ended at once, without a plan."""

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
        """The result; None before the end of the delay."""
        return self._call.result if self._cancelled or self._is_due() else None

    def wait(self, timeout: float | None = None) -> PlanResult | None:
        """Return the result; None before the end of the delay."""
        # a wait for the end of the delay would be endless, since this thread advances the run's clock
        return self._call.wait(timeout) if self._cancelled or self._is_due() else None

    def cancel(self) -> None:
        self._cancelled = True
        self._call.cancel()
