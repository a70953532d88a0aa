"""The interface type GripperInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class GripperInterface(Interface):
    """The interface type GripperInterface.

    A gripper that opens and closes.
    """

    class GripperState(IntEnum):
        """Values of type GripperState.

        What the gripper is, or should be.
        """

        OPEN = 0
        """Its fingers are apart."""

        CLOSED = 1
        """Its fingers are together."""

    OPEN: ClassVar[GripperState]
    CLOSED: ClassVar[GripperState]

    class OpenGripperMessage(Message):
        """The message OpenGripperMessage.

        Let go.
        """

    class CloseGripperMessage(Message):
        """The message CloseGripperMessage.

        Hold.
        """

    gripper_state: GripperState
    """What it is now."""
