"""The interface type SkillExecutorInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class SkillExecutorInterface(Interface):
    """The interface type SkillExecutorInterface.

    An executor of skills for one agent. See docs/skill-board.md.
    """

    class SkillExecutorState(IntEnum):
        """Values of type SkillExecutorState.

        Whether an executor is free.
        """

        IDLE = 0
        """It is free."""

        RESERVED = 1
        """It has answered a master, and waits for its decision."""

        BUSY = 2
        """It executes a skill."""

    IDLE: ClassVar[SkillExecutorState]
    RESERVED: ClassVar[SkillExecutorState]
    BUSY: ClassVar[SkillExecutorState]

    class RequestMessage(Message):
        """The message RequestMessage.

        Who can do this?
        """

        board: str
        """Where to answer: id of a SkillBoardInterface."""

        epoch: int
        """Of that board."""

        master: int
        """Number of the master."""

        agent: str
        """The agent that shall do it."""

        skill: str
        """Name of the skill."""

        parameters: str
        """Its parameters, a JSON object."""

        name: str
        """What the master is called, for people; may be empty."""

        def __init__(
            self,
            board: str = "",
            epoch: int = 0,
            master: int = 0,
            agent: str = "",
            skill: str = "",
            parameters: str = "",
            name: str = "",
        ) -> None: ...

    class ConfirmMessage(Message):
        """The message ConfirmMessage.

        Do what was asked for.
        """

        board: str
        """Id of the board."""

        epoch: int
        """Of that board."""

        master: int
        """Number of the master."""

        def __init__(
            self,
            board: str = "",
            epoch: int = 0,
            master: int = 0,
        ) -> None: ...

    class RejectMessage(Message):
        """The message RejectMessage.

        Somebody else does it, or nobody.
        """

        board: str
        """Id of the board."""

        epoch: int
        """Of that board."""

        master: int
        """Number of the master."""

        def __init__(
            self,
            board: str = "",
            epoch: int = 0,
            master: int = 0,
        ) -> None: ...

    class CancelMessage(Message):
        """The message CancelMessage.

        Stop doing it.
        """

        board: str
        """Id of the board."""

        epoch: int
        """Of that board."""

        master: int
        """Number of the master."""

        def __init__(
            self,
            board: str = "",
            epoch: int = 0,
            master: int = 0,
        ) -> None: ...

    agent: str
    """The agent that it works for."""

    skills: str
    """Names of the skills that it executes, with blanks between."""

    state: SkillExecutorState
    """Whether it is free."""

    board: str
    """The ticket of the master that it works for: name of the board,"""

    epoch: int
    """epoch of the board,"""

    master: int
    """number of the master; 0 when it is idle."""

    skill: str
    """Name of the skill; empty when it is idle."""
