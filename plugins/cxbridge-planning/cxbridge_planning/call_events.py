"""Events of planner calls: a call emits an event at its start and at its end.

A call that cannot start emits a single event.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

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


@dataclass(frozen=True, slots=True)
class PlannerCallReporter:
    """Emits the events of a planner call.

    The fields except the bus are those of the event :class:`~cxbridge.events.PlannerCall`.
    """

    bus: EventBus
    env: str
    call: str
    goal: str
    planner: str
    domain: str
    problem: str

    def report_start(self, call: str, problem: Problem | None = None) -> Self:
        """Report the start of a call; return the reporter with the call's id.

        :param problem: the problem to emit as a source of the run; None if its file is a source already.
        """
        reporter = replace(self, call=call)
        if problem is not None and self.bus.wants(SourceRead):
            text = format_problem(problem).encode("utf-8", "backslashreplace")
            self.bus.emit_source("pddl", self.env, f"{call}.pddl", text, kind="problem", call=call)
        reporter.emit("started")
        return reporter

    def report_end(self, result: PlanResult) -> None:
        """Report the end of a call, with its plan."""
        replace(self, planner=result.planner).emit(
            STATUS_TEXTS[result.status],
            round(result.seconds * MICROSECONDS),
            len(result.actions),
            result.message,
            plan_text(result.actions),
            result.why,
        )

    def report_refusal(self, reason: str) -> None:
        """Report a call that could not start: a single event with the status ``failed``."""
        self.emit("failed", reason=reason)

    def emit(
        self,
        status: str,
        duration_us: int = 0,
        actions: int = 0,
        reason: str = "",
        plan: str = "",
        why: str = "",
    ) -> None:
        """Emit an event of the call."""
        if self.bus.wants(PlannerCall):
            # names from rules are Symbols, a subclass of str, which recorders of events cannot encode
            call = PlannerCall(
                self.bus.clock.now_us(),
                str(self.env),
                str(self.call),
                str(self.goal),
                str(self.planner),
                str(self.domain),
                str(self.problem),
                status,
                duration_us,
                actions,
                reason,
                plan,
                why,
            )
            self.bus.emit(call)
