"""The interface type Position3DInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.accessors import Array
from cxbridge.interfaces.instance import Interface

class Position3DInterface(Interface):
    """The interface type Position3DInterface.

    Where something is in space, and how it is turned.
    """

    frame: str
    """Name of the frame that the pose is in."""

    visibility_history: int
    """How often in a row it was seen (above 0) or was not (below 0); 0 before the first
    look.
    """

    rotation: Array[float]
    """Orientation as a quaternion: x, y, z, w."""

    translation: Array[float]
    """Position: x, y, z, in metres."""

    covariance: Array[float]
    """How certain that is: 6 rows of 6 numbers, for x, y, z and the turns about the
    fixed axes x, y, z.
    """
