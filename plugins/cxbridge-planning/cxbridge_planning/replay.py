"""Plans of a recording, with the recorded delay."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, PlannerCall
from cxbridge.history.plan_steps import parse_plan_text
from cxbridge.run.agent import Run
from cxbridge.run.replay.divergence import Divergence
from cxbridge.run.replay.replay import Replay
from cxbridge.trace.compare.names import replace_names
from cxbridge_planning.call_events import STATUS_TEXTS
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest

_STARTED: Final = "started"
_STATUS: Final = {text: status for status, text in STATUS_TEXTS.items()}


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


def recorded_plans(events: Sequence[PlannerCall], env: str) -> dict[str, RecordedPlan]:
    """Return the finished calls of an environment, by id."""
    begun: dict[str, PlannerCall] = {}
    plans: dict[str, RecordedPlan] = {}
    for event in events:
        if event.env == env and event.call and event.status == _STARTED:
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

    Reports the first call whose problem differs from the recorded problem as the replay's divergence.

    :param run: a run with a replay.
    :param env: the environment that requests plans.
    """

    def __init__(self, run: Run, env: str) -> None:
        super().__init__()
        assert isinstance(run.replay, Replay)
        self._replay = run.replay
        by_scan = (recorded_plans(scan.plans, env) for scan in self._replay.recordings.scans)
        self._plans = next(filter(None, by_scan), {})  # of the first recording that has calls
        self._env = env
        self._now_us = run.clock.now_us
        self._count = 0
        run.bus.subscribe(self._compare_call, PlannerCall)

    def warm_up(self) -> None:
        """Do nothing: a replay may never need a planner."""

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call that reports the recorded plan."""
        self._count += 1
        recorded = self._plans.get(f"plan-{self._count}")  # ids are consecutive numbers
        return (
            super().call(request)
            if recorded is None
            else _RecordedCall(self, request, recorded, self._now_us)
        )

    def _compare_call(self, event: Event) -> None:
        """Compare the problem of a planner call with the recorded problem."""
        assert isinstance(event, PlannerCall)
        expected = self._plans.get(event.call) if event.env == self._env else None
        if expected is None or event.status != _STARTED:
            return
        if replace_names(expected.problem) != replace_names(event.problem):
            start_us = self._replay.recordings.start_us
            divergence = Divergence(
                f"planner of {event.env}",
                int(event.call.rpartition("-")[2]),
                f"plan for {expected.problem}",
                f"plan for {event.problem}",
                (event.time_us - start_us) / MICROSECONDS,
                (expected.time_us - start_us) / MICROSECONDS,
            )
            self._replay.record_divergence(divergence)


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
