"""The feature `blackboard` of a run: interfaces as facts."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    retract_early = context.config.get_bool("/clips/retract-early", default=False)
    return BlackBoardFeature(context.board, retract_early=retract_early)
