"""Publishes calls of planners as events."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from cxbridge.clock import MICROSECONDS
from cxbridge.events import EventBus, PlannerCall, SourceRead
from cxbridge.executive.pddl import Problem, format_problem
from cxbridge.executive.planning.plan_text import plan_text
from cxbridge.executive.planning.planner import PlanResult, PlanStatus

_STATUS = {
    PlanStatus.PLANNED: "found",
    PlanStatus.NO_PLAN: "none",
    PlanStatus.FAILED: "failed",
    PlanStatus.TIMEOUT: "timeout",
    PlanStatus.CANCELLED: "cancelled",
}


@dataclass(frozen=True, slots=True)
class PlannerCallReporter:
    """A call of a planner, as the bus gets it; the fields are those of :class:`PlannerCall`."""

    bus: EventBus
    env: str
    call: str
    goal: str
    planner: str
    domain: str
    problem: str

    def started(self, call: str, problem: Problem | None = None) -> Self:
        """Report that it begins, and return it with its id.

        :param problem: the problem, as a source of the run; None when a file is that already.
        """
        reporter = replace(self, call=call)
        if problem is not None and self.bus.wants(SourceRead):
            text = format_problem(problem).encode("utf-8", "backslashreplace")
            self.bus.emit_source("pddl", self.env, f"{call}.pddl", text, kind="problem", call=call)
        reporter.emit("started")
        return reporter

    def ended(self, result: PlanResult) -> None:
        """Report the result."""
        replace(self, planner=result.planner).emit(
            _STATUS[result.status],
            round(result.seconds * MICROSECONDS),
            len(result.actions),
            result.message,
            plan_text(result.actions),
            result.why,
        )

    def refused(self, reason: str) -> None:
        """Report that it could not be made."""
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
        """Emit an event."""
        if self.bus.wants(PlannerCall):
            self.bus.emit(
                PlannerCall(
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
            )
