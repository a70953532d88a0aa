"""The feature `skill-board` of a run: actions for the executors of several robots."""

from __future__ import annotations

from functools import partial

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.skill_board import SkillBoardFeature
from cxbridge.run.context import RunContext
from cxbridge.run.shared_skill_board import SharedSkillBoard
from cxbridge.skiller.board.desk import SkillDesk


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return SkillBoardFeature(partial(_desk, context.skills))


def _desk(skills: SharedSkillBoard) -> SkillDesk | None:
    return None if skills.station is None else skills.station.desk
