"""Planning: from domain and problem to a plan, see docs/planning.md."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.history.plan_steps import PlannedAction
    from cxbridge_planning.call_events import PlannerCallReporter
    from cxbridge_planning.errors import PlanningError, UnknownPlannerError, UnsupportedProblemError
    from cxbridge_planning.planner import Planner, PlanResult, PlanStatus
    from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest

_NAMES_BY_MODULE = {
    "cxbridge.history.plan_steps": ("PlannedAction",),
    "cxbridge_planning.call_events": ("PlannerCallReporter",),
    "cxbridge_planning.errors": ("PlanningError", "UnknownPlannerError", "UnsupportedProblemError"),
    "cxbridge_planning.planner": ("PlanResult", "PlanStatus", "Planner"),
    "cxbridge_planning.service.service": ("PlanCall", "PlanRequest", "PlanningService"),
}

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


def __getattr__(name: str) -> Any:
    """Import a public name on first use, since a planner process needs only few names."""
    for module, names in _NAMES_BY_MODULE.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
