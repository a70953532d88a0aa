"""Planners that return recorded plans after the recorded delay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.events import PlannerCall
from cxbridge.executive.planning.planner import PlanResult, PlanStatus, parse_plan_text
from cxbridge.executive.planning.service import PlanCall, PlanningService, PlanRequest
from cxbridge.run.replay.divergence import Divergence
from cxbridge.run.replay.scan import Scan
from cxbridge.trace.compare.names import replace_names

STARTED: Final = "started"
_STATUS: Final = {
    "found": PlanStatus.PLANNED,
    "none": PlanStatus.NO_PLAN,
    "failed": PlanStatus.FAILED,
    "timeout": PlanStatus.TIMEOUT,
    "cancelled": PlanStatus.CANCELLED,
}


@dataclass(frozen=True, slots=True)
class RecordedPlan:
    """A planner call with its result.

    :param time_us: the time of the call.
    :param after_us: the microseconds from the call to the result.
    """

    problem: str
    time_us: int
    after_us: int
    result: PlanResult

    def __str__(self) -> str:
        return f"plan for {self.problem}"


def plan_divergence(expected: RecordedPlan, event: PlannerCall, start_us: int) -> Divergence | None:
    """Return the divergence between a planner call and the recorded one; None if the problems are equal.

    :param start_us: the start of the recorded run.
    """
    if replace_names(expected.problem) == replace_names(event.problem):
        return None
    return Divergence(
        f"planner of {event.env}",
        int(event.call.rpartition("-")[2]),
        str(expected),
        f"plan for {event.problem}",
        (event.time_us - start_us) / MICROSECONDS,
        (expected.time_us - start_us) / MICROSECONDS,
    )


def collect_plans(scans: Iterable[Scan], env: str) -> dict[str, RecordedPlan]:
    """Return the calls of an environment by id, from the first recording that has calls."""
    by_scan = (recorded_plans(scan.plans, env) for scan in scans)
    return next(filter(None, by_scan), {})


def recorded_plans(events: Sequence[PlannerCall], env: str) -> dict[str, RecordedPlan]:
    """Return the finished calls of an environment, by id."""
    begun: dict[str, PlannerCall] = {}
    plans: dict[str, RecordedPlan] = {}
    for event in events:
        if event.env == env and event.call and event.status == STARTED:
            begun[event.call] = event
        elif event.env == env and event.call in begun and event.status in _STATUS:
            result = _read_result(event)
            if result is not None:
                start_us = begun[event.call].time_us
                plans[event.call] = RecordedPlan(event.problem, start_us, event.time_us - start_us, result)
    return plans


def _read_result(event: PlannerCall) -> PlanResult | None:
    """Return the result of a call; None if the plan is missing in the recording."""
    try:
        actions = parse_plan_text(event.plan)
    except ValueError:
        return None
    # planners report the number of actions even when they record no plan
    if len(actions) != event.actions:
        return None
    seconds = event.duration_us / MICROSECONDS
    return PlanResult(_STATUS[event.status], event.planner, actions, event.reason, seconds, event.why)


class RecordedPlanning(PlanningService):
    """Returns recorded plans, and calls a planner where no plan is recorded.

    :param plans: plans by call id; ids are consecutive numbers.
    """

    def __init__(self, plans: dict[str, RecordedPlan], clock: Clock) -> None:
        super().__init__()
        self._plans = plans
        self._clock = clock
        self._count = 0

    def warm_up(self) -> None:
        """Do nothing: a replay may never need a planner."""

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call that reports the recorded plan."""
        self._count += 1
        recorded = self._plans.get(f"plan-{self._count}")
        return (
            super().call(request)
            if recorded is None
            else _RecordedCall(self, request, recorded, self._clock.now_us)
        )


class _RecordedCall(PlanCall):
    """A recorded plan, delivered at its recorded time."""

    def __init__(
        self,
        service: PlanningService,
        request: PlanRequest,
        recorded: RecordedPlan,
        now_us: Callable[[], int],
    ) -> None:
        super().__init__(service, request)
        self._recorded = recorded.result
        self._now_us = now_us
        self._due_us = now_us() + recorded.after_us
        self._cancelled = False

    @property
    def result(self) -> PlanResult | None:
        """The result, once it is due or the call is cancelled."""
        if self._cancelled:
            return PlanResult(PlanStatus.CANCELLED, self._recorded.planner, message="planning was cancelled")
        if self._recorded.status is PlanStatus.CANCELLED or self._now_us() < self._due_us:
            return None
        return self._recorded

    def wait(self, timeout: float | None = None) -> PlanResult | None:  # noqa: ARG002 - only the run's clock counts
        """Return :attr:`result` without waiting: only the loop can advance the run's clock."""
        return self.result

    def cancel(self) -> None:
        self._cancelled = self.result is None
