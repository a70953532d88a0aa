"""The feature `problem-expert` of a run: what PlanSys2's clients want, as facts."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return context.experts.feature(context.pddl_parser.domain_of)
