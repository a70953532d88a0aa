"""The feature `robot_memory` of a run: documents shared by agents."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.robot_memory import LIBRARY, RobotMemoryFeature  # noqa: PLC0415

    library = context.paths.robot_memory or LIBRARY
    return RobotMemoryFeature(context.memory, library, context.paths.placeholders)
