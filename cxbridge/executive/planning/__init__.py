"""Planning: domain and problem to a plan, by the embedded planner or another. See docs/planning.md."""

from __future__ import annotations

from cxbridge.executive.planning.call_events import PlannerCallReporter
from cxbridge.executive.planning.errors import PlanningError, UnknownPlannerError, UnsupportedProblemError
from cxbridge.executive.planning.planner import PlannedAction, Planner, PlanResult, PlanStatus
from cxbridge.executive.planning.service import PlanCall, PlanningService, PlanRequest

__all__ = [
    "PlanCall",
    "PlanRequest",
    "PlanResult",
    "PlanStatus",
    "PlannedAction",
    "Planner",
    "PlannerCallReporter",
    "PlanningError",
    "PlanningService",
    "UnknownPlannerError",
    "UnsupportedProblemError",
]
