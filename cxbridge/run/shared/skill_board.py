"""The skill board of a run: one for the component that serves it and the rules that use it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.service import SkillBoardService


class SharedSkillBoard(Struct):
    """The skill board of a run or a daemon; None while there is none.

    :ivar execution: how its executors execute calls that begin; None: as the configuration says.
    """

    service: SkillBoardService | None = None
    execution: Execution | None = None
