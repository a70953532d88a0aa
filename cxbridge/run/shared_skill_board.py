"""The skill board of a run: one for the component that serves it and the rules that use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cxbridge.ros2cx.skills import Ros2CxSkills
    from cxbridge.skiller.board.service import SkillBoardService


@dataclass(slots=True)
class SharedSkillBoard:
    """The skill board of a run or a daemon; None while there is none."""

    service: SkillBoardService | None = None
    ros2cx: Ros2CxSkills | None = None
