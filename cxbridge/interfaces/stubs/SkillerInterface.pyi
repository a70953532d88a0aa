"""The interface type SkillerInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class SkillerInterface(Interface):
    """The interface type SkillerInterface.

    The door to the Skiller: readers send skill strings as messages, the Skiller tells
    here what it does. Commands of the exclusive controller alone are heeded.
    """

    class SkillStatusEnum(IntEnum):
        """Values of type SkillStatusEnum.

        How the execution of a skill string stands.
        """

        S_INACTIVE = 0
        """Nothing has been asked for, or it was stopped."""

        S_FINAL = 1
        """The skill string was carried out with success."""

        S_RUNNING = 2
        """The skill string is being carried out."""

        S_FAILED = 3
        """The skill string has failed for good; the field error says why."""

    S_INACTIVE: ClassVar[SkillStatusEnum]
    S_FINAL: ClassVar[SkillStatusEnum]
    S_RUNNING: ClassVar[SkillStatusEnum]
    S_FAILED: ClassVar[SkillStatusEnum]

    class ExecSkillMessage(Message):
        """The message ExecSkillMessage.

        Carry out a skill string, in place of the one that runs.
        """

        skill_string: str
        """The skill string that runs now or ran last; longer ones are cut."""

        def __init__(
            self,
            skill_string: str = "",
        ) -> None: ...

    class RestartInterpreterMessage(Message):
        """The message RestartInterpreterMessage.

        Throw the Lua interpreter away and begin with a fresh one.
        """

    class StopExecMessage(Message):
        """The message StopExecMessage.

        Stop the skill string that runs.
        """

    class AcquireControlMessage(Message):
        """The message AcquireControlMessage.

        Make the sending instance the exclusive controller.
        """

        steal_control: bool
        """Take control even from an instance that has it."""

        def __init__(
            self,
            steal_control: bool = False,
        ) -> None: ...

    class ReleaseControlMessage(Message):
        """The message ReleaseControlMessage.

        Give exclusive control back.
        """

    skill_string: str
    """The skill string that runs now or ran last; longer ones are cut."""

    error: str
    """Why the skill string failed, in words of the skill."""

    exclusive_controller: str
    """Serial of the instance that may give commands, as text of 36 characters; empty
    when nobody may.
    """

    msgid: int
    """Id of the message that is carried out, 0 when there is none."""

    status: SkillStatusEnum
    """How the skill string stands."""
