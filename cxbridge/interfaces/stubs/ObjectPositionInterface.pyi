"""The interface type ObjectPositionInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from typing import ClassVar

from cxbridge.interfaces.accessors import Array
from cxbridge.interfaces.instance import Interface

class ObjectPositionInterface(Interface):
    """The interface type ObjectPositionInterface.

    Where an object is, how it moves and how certain that is. Metres, radians, seconds.
    A covariance is a matrix of 3 rows with 3 numbers.
    """

    TYPE_OTHER: ClassVar[int]
    """Anything else."""

    TYPE_BALL: ClassVar[int]
    """A ball."""

    TYPE_OPPONENT: ClassVar[int]
    """A robot of the other team."""

    TYPE_TEAMMEMBER: ClassVar[int]
    """A robot of the own team."""

    TYPE_LINE: ClassVar[int]
    """A line: begins at the position, goes along the extent."""

    TYPE_SELF: ClassVar[int]
    """The robot itself."""

    TYPE_GOAL_BLUE: ClassVar[int]
    """The blue goal."""

    TYPE_GOAL_YELLOW: ClassVar[int]
    """The yellow goal."""

    FLAG_NONE: ClassVar[int]
    """None of those below."""

    FLAG_HAS_WORLD: ClassVar[int]
    """The position in the world."""

    FLAG_HAS_RELATIVE_CARTESIAN: ClassVar[int]
    """The position seen from the robot."""

    FLAG_HAS_RELATIVE_POLAR: ClassVar[int]
    """Bearing, slope and distance."""

    FLAG_HAS_EULER_ANGLES: ClassVar[int]
    """Roll, pitch and yaw, seen from the robot."""

    FLAG_HAS_EXTENT: ClassVar[int]
    """The extent."""

    FLAG_HAS_VOLUME_EXTENT: ClassVar[int]
    """The extent is a volume; needs FLAG_HAS_EXTENT."""

    FLAG_HAS_CIRCULAR_EXTENT: ClassVar[int]
    """The extent is a diameter, in extent_x."""

    FLAG_HAS_COVARIANCES: ClassVar[int]
    """The covariances of all that is filled in."""

    FLAG_HAS_WORLD_VELOCITY: ClassVar[int]
    """The velocity in the world."""

    FLAG_HAS_Z_AS_ORI: ClassVar[int]
    """Every Z is an orientation."""

    FLAG_IS_FIXED_OBJECT: ClassVar[int]
    """It stands still: may be tracked by odometry while unseen."""

    object_type: int
    """What it is: one of the TYPE_ constants."""

    flags: int
    """What is filled in: FLAG_ constants joined by bitwise or."""

    visible: bool
    """Whether it is seen now."""

    visibility_history: int
    """How often in a row it was seen (above 0) or was not (below 0)."""

    roll: float
    """Its turn about X."""

    pitch: float
    """Its turn about Y."""

    yaw: float
    """Its turn about Z."""

    distance: float
    """How far it is on the ground."""

    bearing: float
    """In which direction, 0 is straight ahead."""

    slope: float
    """How high above the ground, as an angle."""

    dbs_covariance: Array[float]
    """Certainty of distance, bearing and slope."""

    world_x: float
    """Position in the world: X."""

    world_y: float
    """Position in the world: Y."""

    world_z: float
    """Position in the world: Z."""

    world_xyz_covariance: Array[float]
    """Certainty of the position in the world."""

    relative_x: float
    """Position seen from the robot: X."""

    relative_y: float
    """Position seen from the robot: Y."""

    relative_z: float
    """Position seen from the robot: Z."""

    relative_xyz_covariance: Array[float]
    """Certainty of the position seen from the robot."""

    extent_x: float
    """Size along X."""

    extent_y: float
    """Size along Y."""

    extent_z: float
    """Size along Z."""

    world_x_velocity: float
    """Velocity in the world: X."""

    world_y_velocity: float
    """Velocity in the world: Y."""

    world_z_velocity: float
    """Velocity in the world: Z."""

    world_xyz_velocity_covariance: Array[float]
    """Certainty of the velocity in the world."""

    relative_x_velocity: float
    """Velocity seen from the robot: X."""

    relative_y_velocity: float
    """Velocity seen from the robot: Y."""

    relative_z_velocity: float
    """Velocity seen from the robot: Z."""

    relative_xyz_velocity_covariance: Array[float]
    """Certainty of the velocity seen from the robot."""
