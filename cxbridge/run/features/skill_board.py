"""The feature `skill-board` of a run: actions for the executors of several robots."""

from __future__ import annotations

from functools import partial

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.skill_board import SkillBoardFeature
from cxbridge.run.context import RunContext
from cxbridge.run.shared_skill_board import SharedSkillBoard
from cxbridge.skiller.board.local_calls import LocalSkillCalls


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return SkillBoardFeature(partial(_local_calls, context.skills))


def _local_calls(skills: SharedSkillBoard) -> LocalSkillCalls | None:
    return None if skills.service is None else skills.service.local_calls
