"""The feature `robot_memory` of a run: documents shared by agents."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.robot_memory import LIBRARY, RobotMemoryFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    library = context.paths.robot_memory or LIBRARY
    return RobotMemoryFeature(context.memory, library, context.paths.placeholders)
