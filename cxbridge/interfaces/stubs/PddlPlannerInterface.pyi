"""The interface type PddlPlannerInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class PddlPlannerInterface(Interface):
    """The interface type PddlPlannerInterface.

    A PDDL planner that reads the problem file and puts its plan into the robot memory.
    """

    class PlanMessage(Message):
        """The message PlanMessage.

        Run the planner.
        """

    msg_id: int
    """Id of the message that was worked on last."""

    final: bool
    """Whether the planner has come to an end."""

    success: bool
    """Whether there is a plan."""

    active_planner: str
    """Name of the planner in use."""
