"""Planning: from domain and problem to a plan, see docs/planning.md."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.executive.planning.call_events import PlannerCallReporter
    from cxbridge.executive.planning.errors import PlanningError, UnknownPlannerError, UnsupportedProblemError
    from cxbridge.executive.planning.planner import PlannedAction, Planner, PlanResult, PlanStatus
    from cxbridge.executive.planning.service import PlanCall, PlanningService, PlanRequest

_MODULES = {
    "call_events": ("PlannerCallReporter",),
    "errors": ("PlanningError", "UnknownPlannerError", "UnsupportedProblemError"),
    "planner": ("PlanResult", "PlanStatus", "PlannedAction", "Planner"),
    "service": ("PlanCall", "PlanRequest", "PlanningService"),
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
    """Import a name on first use: a planner process needs only few of them."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
