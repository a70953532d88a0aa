"""Plans of a recording, with the recorded delay."""

from __future__ import annotations

from collections.abc import Sequence
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
from cxbridge_planning.service.delayed import DelayedCall, EndedCall
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest

_STARTED: Final = "started"
_STATUSES: Final = {text: status for status, text in STATUS_TEXTS.items()}


@dataclass(frozen=True, slots=True)
class RecordedPlan:
    """A planner call with its result.

    :param start_event: the event at the start of the call.
    :param delay_us: the microseconds from the call to the result.
    """

    start_event: PlannerCall
    delay_us: int
    result: PlanResult


def recorded_plans(events: Sequence[PlannerCall], env: str) -> dict[str, RecordedPlan]:
    """Return the finished calls of an environment, by id."""
    start_events: dict[str, PlannerCall] = {}
    plans: dict[str, RecordedPlan] = {}
    for event in events:
        if event.env == env and event.call and event.status == _STARTED:
            start_events[event.call] = event
        elif event.env == env and event.call in start_events and event.status in _STATUSES:
            result = _read_result(event)
            if result is not None:
                start_event = start_events[event.call]
                plans[event.call] = RecordedPlan(start_event, event.time_us - start_event.time_us, result)
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
    return PlanResult(
        _STATUSES[event.status],
        event.planner,
        actions,
        event.reason,
        seconds=event.duration_us / MICROSECONDS,
        why=event.why,
    )


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
        plans_of_recordings = (
            recorded_plans(scan.planner_calls, env) for scan in self._replay.recordings.scans
        )
        self._plans = next(filter(None, plans_of_recordings), {})  # of the first recording that has calls
        self._env, self._now_us = env, run.clock.now_us
        self._call_count = 0
        run.bus.subscribe(self._compare_call, PlannerCall)

    def warm_up(self) -> None:
        """Do nothing: a replay may never need a planner."""

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call that reports the recorded plan."""
        self._call_count += 1
        # the ids have the same consecutive numbers as in the feature `planner`
        recorded_plan = self._plans.get(f"plan-{self._call_count}")
        if recorded_plan is None:
            return super().call(request)
        due_us = self._now_us() + recorded_plan.delay_us
        # a cancelled call ends when the replay cancels it, as in the recording
        is_cancelled = recorded_plan.result.status is PlanStatus.CANCELLED
        call = EndedCall(self, request, recorded_plan.result)
        return DelayedCall(self, call, lambda: not is_cancelled and self._now_us() >= due_us)

    def _compare_call(self, event: Event) -> None:
        """Compare the problem of a planner call with the recorded problem."""
        assert isinstance(event, PlannerCall)
        recorded_plan = self._plans.get(event.call) if event.env == self._env else None
        if recorded_plan is None or event.status != _STARTED:
            return
        recorded_event = recorded_plan.start_event
        if replace_names(recorded_event.problem) != replace_names(event.problem):
            start_us = self._replay.recordings.start_us
            self._replay.record_divergence(
                Divergence(
                    f"planner of {event.env}",
                    int(event.call.rpartition("-")[2]),  # the number in the id plan-NUMBER
                    f"plan for {recorded_event.problem}",
                    f"plan for {event.problem}",
                    (event.time_us - start_us) / MICROSECONDS,
                    (recorded_event.time_us - start_us) / MICROSECONDS,
                )
            )
