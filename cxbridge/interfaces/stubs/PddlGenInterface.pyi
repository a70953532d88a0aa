"""The interface type PddlGenInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class PddlGenInterface(Interface):
    """The interface type PddlGenInterface.

    The generator of PDDL problem files: fills a template from the robot memory.
    """

    class GenerateMessage(Message):
        """The message GenerateMessage.

        Write the problem file anew.
        """

        goal: str
        """A goal formula that the template may use; may be empty."""

        def __init__(
            self,
            goal: str = "",
        ) -> None: ...

    msg_id: int
    """Id of the message that was worked on last."""

    final: bool
    """Whether the problem file is written."""
