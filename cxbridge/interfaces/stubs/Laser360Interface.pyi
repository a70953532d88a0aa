"""The interface type Laser360Interface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.accessors import Array
from cxbridge.interfaces.instance import Interface

class Laser360Interface(Interface):
    """The interface type Laser360Interface.

    One scan of a laser scanner: a beam for each degree, the first straight ahead.
    """

    frame: str
    """The scanner's frame."""

    distances: Array[float]
    """How far each beam goes, in metres."""

    clockwise_angle: bool
    """Whether the beams go round clockwise."""
