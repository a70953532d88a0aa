"""The feature `planner` of a run: plans from PDDL planners."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.planner import PlannerFeature
from cxbridge.executive.planning.settings import PlannerSettings
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    settings = PlannerSettings.from_config(context.config)
    return PlannerFeature(settings, context.pddl_parser.domain_of, context.make_planning)
