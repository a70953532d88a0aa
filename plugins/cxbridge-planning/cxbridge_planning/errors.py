"""Errors of planning."""

from __future__ import annotations

from cxbridge.errors import ExecutiveError


class PlanningError(ExecutiveError):
    """Planning failed: the planner refused the problem, crashed, or is not installed."""


class UnsupportedProblemError(PlanningError):
    """The planner does not support a feature of the domain or problem."""


class UnknownPlannerError(PlanningError):
    """The planner does not exist."""
