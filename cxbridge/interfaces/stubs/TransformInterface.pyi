"""The interface type TransformInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.accessors import Array
from cxbridge.interfaces.instance import Interface

class TransformInterface(Interface):
    """The interface type TransformInterface.

    One coordinate transform of the tree of frames. The block's time stamp is the time
    that the transform holds for, so set it by hand.
    """

    frame: str
    """The parent frame."""

    child_frame: str
    """The frame that is placed in the parent."""

    static_transform: bool
    """Whether it never changes."""

    translation: Array[float]
    """Origin of the child in the parent: x, y, z, in metres."""

    rotation: Array[float]
    """Rotation of the child in the parent, a quaternion: x, y, z, w."""
