"""The interface type SkillBoardInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class SkillBoardInterface(Interface):
    """The interface type SkillBoardInterface.

    Where masters of running actions hear from executors. See docs/skill-board.md.
    """

    class SkillOutcome(IntEnum):
        """Values of type SkillOutcome.

        How the execution of a skill ended.
        """

        SUCCEEDED = 0
        """It was carried out."""

        FAILED = 1
        """It was not; the error says why."""

        CANCELLED = 2
        """It was stopped on request."""

        REFUSED = 3
        """It was not begun: the executor is not free for the master any more."""

    SUCCEEDED: ClassVar[SkillOutcome]
    FAILED: ClassVar[SkillOutcome]
    CANCELLED: ClassVar[SkillOutcome]
    REFUSED: ClassVar[SkillOutcome]

    class ResponseMessage(Message):
        """The message ResponseMessage.

        An executor can do what the master has asked for, and keeps itself free for it.
        """

        epoch: int
        """Of the board that has asked."""

        master: int
        """Number of the master."""

        executor: str
        """Id of the executor."""

        def __init__(
            self,
            epoch: int = 0,
            master: int = 0,
            executor: str = "",
        ) -> None: ...

    class FeedbackMessage(Message):
        """The message FeedbackMessage.

        An executor executes the skill of the master; the first one says that it has
        begun.
        """

        epoch: int
        """Of the board that has asked."""

        master: int
        """Number of the master."""

        executor: str
        """Id of the executor."""

        progress: float
        """From 0 to 1."""

        text: str
        """What it is doing."""

        def __init__(
            self,
            epoch: int = 0,
            master: int = 0,
            executor: str = "",
            progress: float = 0.0,
            text: str = "",
        ) -> None: ...

    class FinishMessage(Message):
        """The message FinishMessage.

        The execution has ended; the executor is free again.
        """

        epoch: int
        """Of the board that has asked."""

        master: int
        """Number of the master."""

        executor: str
        """Id of the executor."""

        outcome: SkillBoardInterface.SkillOutcome
        """How it has ended."""

        error: str
        """Why it has failed."""

        progress: float
        """How far it came, from 0 to 1."""

        text: str
        """The executor's last word."""

        def __init__(
            self,
            epoch: int = 0,
            master: int = 0,
            executor: str = "",
            outcome: SkillBoardInterface.SkillOutcome | int = 0,
            error: str = "",
            progress: float = 0.0,
            text: str = "",
        ) -> None: ...

    epoch: int
    """Another number at each start; part of every ticket."""

    asking: int
    """How many masters look for an executor."""

    running: int
    """How many masters have one."""
