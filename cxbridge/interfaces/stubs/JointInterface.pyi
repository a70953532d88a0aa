"""The interface type JointInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface

class JointInterface(Interface):
    """The interface type JointInterface.

    One joint.
    """

    position: float
    """Its angle, in radians."""

    velocity: float
    """How fast the angle changes, in radians a second."""
