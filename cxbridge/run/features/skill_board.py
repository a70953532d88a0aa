"""The feature `skill-board` of a run: actions for the executors of several robots."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext
from cxbridge.run.shared.skill_board import SharedSkillBoard

if TYPE_CHECKING:
    from cxbridge.skiller.board.local_calls import LocalSkillCalls

NEEDED_SECTION = "/skill-board"


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.skill_board import SkillBoardFeature  # noqa: PLC0415

    return SkillBoardFeature(partial(_local_calls, context.skills))


def _local_calls(skills: SharedSkillBoard) -> LocalSkillCalls | None:
    return None if skills.service is None else skills.service.local_calls
