"""Faults of planners that a program decides on: a call gets no plan, fails, or gets its plan late."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.delayed import DelayedCall, EndedCall
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest

FAULTS: Final = "planning.faults"
"""The name of a program's :data:`ChooseFault` among the additions to a run."""

ChooseFault = Callable[[str, str], tuple[str, float]]
"""Chooses the fault of a call, given the environment and the name of the problem.

The result is the status of a call that gets no plan (empty: the call gets its plan), and the seconds from the
request during which the plan is withheld.
"""


class FaultyPlanning(PlanningService):
    """A planning service whose faults a program chooses.

    :param choose_fault: chooses the fault of each call.
    :param env: the environment that requests plans.
    :param now_us: returns the time of the run.
    """

    def __init__(self, choose_fault: ChooseFault, env: str, now_us: Callable[[], int]) -> None:
        super().__init__()
        self._choose_fault, self._env, self._now_us = choose_fault, env, now_us

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call with the chosen fault, if any: it has ended without a plan, or its plan is late.

        :raises ValueError: if the chosen status is not a value of :class:`PlanStatus`.
        """
        status, delay_s = self._choose_fault(self._env, request.problem.name)
        if status:
            message = "the program has chosen this result"
            return EndedCall(self, request, PlanResult(PlanStatus(status), request.planner, message=message))
        due_us = self._now_us() + round(delay_s * MICROSECONDS)
        call = super().call(request)
        return DelayedCall(self, call, lambda: self._now_us() >= due_us) if delay_s else call
