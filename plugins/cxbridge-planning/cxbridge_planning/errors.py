"""Errors of planning."""

from __future__ import annotations

from typing import Final

from cxbridge.errors import ExecutiveError

MAX_EXCERPT: Final = 300
"""The maximum number of characters of an engine's output or message in an error."""


class PlanningError(ExecutiveError):
    """Planning failed, e.g. because the planner refused the problem, crashed, or is not installed."""


class UnsupportedProblemError(PlanningError):
    """The planner does not support a feature of the domain or problem, or is not installed."""


class UnknownPlannerError(PlanningError):
    """The planner or one of its options does not exist, or the value of an option is invalid."""
