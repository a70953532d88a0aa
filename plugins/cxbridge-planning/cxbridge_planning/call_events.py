"""Events of planner calls: a call emits an event at its start and at its end.

A call that cannot start emits a single event.
"""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from cxbridge.clock import MICROSECONDS
from cxbridge.events import EventBus, PlannerCall, SourceRead
from cxbridge.executive.pddl import Problem, format_problem
from cxbridge.history.plan_steps import plan_text
from cxbridge_planning.planner import PlanResult, PlanStatus

STATUS_TEXTS = {
    PlanStatus.PLANNED: "found",
    PlanStatus.NO_PLAN: "none",
    PlanStatus.FAILED: "failed",
    PlanStatus.TIMEOUT: "timeout",
    PlanStatus.CANCELLED: "cancelled",
}
"""The statuses in events; a call without a result has the status ``started``."""


class PlannerCallReporter:
    """Emits the events of a planner call.

    The parameters except the bus are fields of the event :class:`~cxbridge.events.PlannerCall`.
    """

    def __init__(
        self, bus: EventBus, *, env: str, goal: str, planner: str, domain: str, problem: str
    ) -> None:
        # names from rules are Symbols, a subclass of str, which recorders of events cannot encode
        self._bus = bus
        self._event = PlannerCall(
            time_us=0,  # each emission sets the time
            env=str(env),
            call="",
            goal=str(goal),
            planner=str(planner),
            domain=str(domain),
            problem=str(problem),
            status="started",
            duration_us=0,
            actions=0,
            reason="",
        )

    def report_start(self, call: str, problem: Problem | None = None) -> None:
        """Report the start of a call.

        :param call: the id of the call, also for later events.
        :param problem: the problem to emit as a source of the run; None if its file is a source already.
        """
        self._event = replace(self._event, call=str(call))
        if problem is not None and self._bus.wants(SourceRead):
            text = format_problem(problem).encode("utf-8", "backslashreplace")
            self._bus.emit_source("pddl", self._event.env, f"{call}.pddl", text, kind="problem", call=call)
        self._emit()

    def report_end(self, result: PlanResult) -> None:
        """Report the end of a call, with its plan."""
        self._emit(
            planner=result.planner,
            status=STATUS_TEXTS[result.status],
            duration_us=round(result.seconds * MICROSECONDS),
            actions=len(result.actions),
            reason=result.message,
            plan=plan_text(result.actions),
            why=result.why,
        )

    def report_refusal(self, reason: str) -> None:
        """Report a call that could not start: a single event with the status ``failed``."""
        self._emit(status="failed", reason=reason)

    def _emit(self, **fields: Any) -> None:
        """Emit the event of a call with changed fields."""
        if self._bus.wants(PlannerCall):
            self._bus.emit(replace(self._event, time_us=self._bus.clock.now_us(), **fields))
