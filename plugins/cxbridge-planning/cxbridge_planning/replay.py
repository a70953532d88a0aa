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
_STATUSES_BY_TEXT: Final = {text: status for status, text in STATUS_TEXTS.items()}


@dataclass(frozen=True, slots=True)
class RecordedCall:
    """A recorded planner call with its result.

    :param start_event: the event at the start of the call.
    :param delay_us: the microseconds from the call to the result.
    """

    start_event: PlannerCall
    delay_us: int
    result: PlanResult


def find_recorded_calls(events: Sequence[PlannerCall], env: str) -> dict[str, RecordedCall]:
    """Return the finished calls of an environment, by id; without the calls whose plan was not recorded."""
    start_events: dict[str, PlannerCall] = {}
    recorded_calls: dict[str, RecordedCall] = {}
    for event in events:
        if event.env == env and event.call and event.status == _STARTED:
            start_events[event.call] = event
        elif event.env == env and event.call in start_events and event.status in _STATUSES_BY_TEXT:
            result = _read_result(event)
            if result is not None:
                start_event = start_events[event.call]
                delay_us = event.time_us - start_event.time_us
                recorded_calls[event.call] = RecordedCall(start_event, delay_us, result)
    return recorded_calls


def _read_result(event: PlannerCall) -> PlanResult | None:
    """Return the result of a call; None if the recording has no readable plan."""
    try:
        actions = parse_plan_text(event.plan)
    except ValueError:
        return None
    # an event has the number of actions even if the plan was not recorded
    if len(actions) != event.actions:
        return None
    return PlanResult(
        _STATUSES_BY_TEXT[event.status],
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
        calls_of_recordings = (
            find_recorded_calls(scan.planner_calls, env) for scan in self._replay.recordings.scans
        )
        # of the first recording that has calls
        self._recorded_calls = next(filter(None, calls_of_recordings), {})
        self._env, self._now_us = env, run.clock.now_us
        self._call_count = 0
        run.bus.subscribe(self._compare_call, PlannerCall)

    def warm_up(self) -> None:
        """Do nothing: a replay may never need a planner."""

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call with the recorded result and delay; without a recorded call, call a planner."""
        self._call_count += 1
        # the ids have the same consecutive numbers as in the feature `planner`
        recorded_call = self._recorded_calls.get(f"plan-{self._call_count}")
        if recorded_call is None:
            return super().call(request)
        due_us = self._now_us() + recorded_call.delay_us
        # a cancelled call ends when the replay cancels it, as in the recording
        is_cancelled = recorded_call.result.status is PlanStatus.CANCELLED
        call = EndedCall(self, request, recorded_call.result)
        return DelayedCall(self, call, lambda: not is_cancelled and self._now_us() >= due_us)

    def _compare_call(self, event: Event) -> None:
        """Compare the problem of a planner call with the recorded problem."""
        assert isinstance(event, PlannerCall)
        recorded_call = self._recorded_calls.get(event.call) if event.env == self._env else None
        if recorded_call is None or event.status != _STARTED:
            return
        recorded_event = recorded_call.start_event
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
