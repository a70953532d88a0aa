"""The errors of planning."""

from __future__ import annotations

from cxbridge.errors import ExecutiveError


class PlanningError(ExecutiveError):
    """There is no plan because something went wrong: the planner refuses, crashes, is not installed."""


class UnsupportedProblemError(PlanningError):
    """The planner does not understand something that the domain or the problem needs."""


class UnknownPlannerError(PlanningError):
    """There is no planner of that name."""
