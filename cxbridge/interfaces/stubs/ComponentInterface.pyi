"""The interface type ComponentInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface

class ComponentInterface(Interface):
    """The interface type ComponentInterface.

    A component of a cxbridge daemon; the id is its name.
    """

    class LifecycleState(IntEnum):
        """Values of type LifecycleState.

        Where in its life a component is.
        """

        UNCONFIGURED = 0
        """It has acquired nothing."""

        INACTIVE = 1
        """It has what it needs and does not work."""

        ACTIVE = 2
        """It works."""

        FINALIZED = 3
        """It has ended."""

    UNCONFIGURED: ClassVar[LifecycleState]
    INACTIVE: ClassVar[LifecycleState]
    ACTIVE: ClassVar[LifecycleState]
    FINALIZED: ClassVar[LifecycleState]

    position: int
    """Its place in the order of the start, from 1."""

    state: LifecycleState
    """Where in its life it is."""

    since: int
    """When it came into this state, in microseconds since the epoch."""

    reason: str
    """Why it is not active; empty when it is."""
