"""The feature `planner` of a run: plans from PDDL planners."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext

SECTION = "/planner"


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.planner import PlannerFeature  # noqa: PLC0415
    from cxbridge.executive.planning.settings import PlannerSettings  # noqa: PLC0415

    settings = PlannerSettings.from_config(context.config)
    return PlannerFeature(settings, context.pddl_parser.domain_of, context.make_planning)
