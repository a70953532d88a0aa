"""The interface type NavigatorInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class NavigatorInterface(Interface):
    """The interface type NavigatorInterface.

    Moves the robot to a target. Lengths in metres, angles in radians; X points forward,
    Y to the left. Targets are seen from the robot, the fields are in the navigator's
    own frame, which begins where it started.
    """

    class DriveMode(IntEnum):
        """Values of type DriveMode.

        How the robot may move.
        """

        MovingNotAllowed = 0
        """Not at all."""

        Forward = 1
        """Forwards alone."""

        AllowBackward = 2
        """Backwards too, where that is shorter."""

        Backward = 3
        """Backwards alone."""

        ESCAPE = 4
        """Away from an obstacle."""

    MovingNotAllowed: ClassVar[DriveMode]
    Forward: ClassVar[DriveMode]
    AllowBackward: ClassVar[DriveMode]
    Backward: ClassVar[DriveMode]
    ESCAPE: ClassVar[DriveMode]

    class OrientationMode(IntEnum):
        """Values of type OrientationMode.

        When the robot turns to the wanted orientation.
        """

        OrientAtTarget = 0
        """After it has arrived."""

        OrientDuringTravel = 1
        """On the way, on platforms that can turn while they move."""

    OrientAtTarget: ClassVar[OrientationMode]
    OrientDuringTravel: ClassVar[OrientationMode]

    ERROR_NONE: ClassVar[int]
    """All is well."""

    ERROR_MOTOR: ClassVar[int]
    """The motor does not answer."""

    ERROR_OBSTRUCTION: ClassVar[int]
    """Something stands in the way."""

    ERROR_UNKNOWN_PLACE: ClassVar[int]
    """Nobody knows a place of that name."""

    ERROR_PATH_GEN_FAIL: ClassVar[int]
    """There is no path to the target."""

    FLAG_NONE: ClassVar[int]
    """None of those below."""

    FLAG_CART_GOTO: ClassVar[int]
    """Goes to cartesian targets."""

    FLAG_POLAR_GOTO: ClassVar[int]
    """Goes to polar targets."""

    FLAG_PLACE_GOTO: ClassVar[int]
    """Goes to places by name."""

    FLAG_UPDATES_DEST_DIST: ClassVar[int]
    """Keeps dest_dist up to date on the way."""

    FLAG_SECURITY_DISTANCE: ClassVar[int]
    """Takes another security distance at any time."""

    FLAG_ESCAPING: ClassVar[int]
    """Can escape from obstacles, or leave that."""

    class StopMessage(Message):
        """The message StopMessage.

        Stand still.
        """

        msgid: int
        """Stop only what the message of this id began, so that an order of somebody
        else goes on; 0 stops everything.
        """

        def __init__(
            self,
            msgid: int = 0,
        ) -> None: ...

    class TurnMessage(Message):
        """The message TurnMessage.

        Turn on the spot, by the whole angle even when that is more than a turn.
        """

        angle: float
        """By how much."""

        velocity: float
        """How fast, in radians a second; 0 for the usual."""

        def __init__(
            self,
            angle: float = 0.0,
            velocity: float = 0.0,
        ) -> None: ...

    class CartesianGotoMessage(Message):
        """The message CartesianGotoMessage.

        Go to a point.
        """

        x: float
        """The point: X."""

        y: float
        """The point: Y."""

        orientation: float
        """How to stand there."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            orientation: float = 0.0,
        ) -> None: ...

    class CartesianGotoWithToleranceMessage(Message):
        """The message CartesianGotoWithToleranceMessage.

        Go near a point.
        """

        x: float
        """The point: X."""

        y: float
        """The point: Y."""

        orientation: float
        """How to stand there."""

        translation_tolerance: float
        """How near is near enough."""

        orientation_tolerance: float
        """By how much the orientation may differ."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            orientation: float = 0.0,
            translation_tolerance: float = 0.0,
            orientation_tolerance: float = 0.0,
        ) -> None: ...

    class CartesianGotoWithFrameMessage(Message):
        """The message CartesianGotoWithFrameMessage.

        Go to a point of some frame.
        """

        x: float
        """The point: X."""

        y: float
        """The point: Y."""

        orientation: float
        """How to stand there."""

        target_frame: str
        """The frame of the point."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            orientation: float = 0.0,
            target_frame: str = "",
        ) -> None: ...

    class CartesianGotoWithFrameWithToleranceMessage(Message):
        """The message CartesianGotoWithFrameWithToleranceMessage.

        Go near a point of some frame.
        """

        x: float
        """The point: X."""

        y: float
        """The point: Y."""

        orientation: float
        """How to stand there."""

        target_frame: str
        """The frame of the point."""

        translation_tolerance: float
        """How near is near enough."""

        orientation_tolerance: float
        """By how much the orientation may differ."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            orientation: float = 0.0,
            target_frame: str = "",
            translation_tolerance: float = 0.0,
            orientation_tolerance: float = 0.0,
        ) -> None: ...

    class PolarGotoMessage(Message):
        """The message PolarGotoMessage.

        Go to a point that is given by direction and distance.
        """

        phi: float
        """The direction, 0 is straight ahead."""

        dist: float
        """The distance."""

        orientation: float
        """How to stand there."""

        def __init__(
            self,
            phi: float = 0.0,
            dist: float = 0.0,
            orientation: float = 0.0,
        ) -> None: ...

    class PlaceGotoMessage(Message):
        """The message PlaceGotoMessage.

        Go to a place.
        """

        place: str
        """Name of the place."""

        def __init__(
            self,
            place: str = "",
        ) -> None: ...

    class PlaceWithOriGotoMessage(Message):
        """The message PlaceWithOriGotoMessage.

        Go to a place and turn there.
        """

        place: str
        """Name of the place."""

        orientation: float
        """How to stand there."""

        def __init__(
            self,
            place: str = "",
            orientation: float = 0.0,
        ) -> None: ...

    class ObstacleMessage(Message):
        """The message ObstacleMessage.

        Show an obstacle; for graphical tools.
        """

        x: float
        """Where it is: X."""

        y: float
        """Where it is: Y."""

        width: float
        """How wide it is."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            width: float = 0.0,
        ) -> None: ...

    class ResetOdometryMessage(Message):
        """The message ResetOdometryMessage.

        Call the present position the origin.
        """

    class SetMaxVelocityMessage(Message):
        """The message SetMaxVelocityMessage.

        Limit the travel.
        """

        max_velocity: float
        """Fastest travel, in metres a second."""

        def __init__(
            self,
            max_velocity: float = 0.0,
        ) -> None: ...

    class SetMaxRotationMessage(Message):
        """The message SetMaxRotationMessage.

        Limit the turns.
        """

        max_rotation: float
        """Fastest turn, in radians a second."""

        def __init__(
            self,
            max_rotation: float = 0.0,
        ) -> None: ...

    class SetEscapingMessage(Message):
        """The message SetEscapingMessage.

        Allow escaping, or forbid it.
        """

        escaping_enabled: bool
        """Whether to escape from an obstacle; stops at it otherwise."""

        def __init__(
            self,
            escaping_enabled: bool = False,
        ) -> None: ...

    class SetSecurityDistanceMessage(Message):
        """The message SetSecurityDistanceMessage.

        Keep another distance from obstacles.
        """

        security_distance: float
        """How far to stay away from obstacles."""

        def __init__(
            self,
            security_distance: float = 0.0,
        ) -> None: ...

    class SetDriveModeMessage(Message):
        """The message SetDriveModeMessage.

        Move in another mode.
        """

        drive_mode: NavigatorInterface.DriveMode
        """How the robot may move now."""

        def __init__(
            self,
            drive_mode: NavigatorInterface.DriveMode | int = 0,
        ) -> None: ...

    class SetStopAtTargetMessage(Message):
        """The message SetStopAtTargetMessage.

        Say whether to stand still at targets.
        """

        stop_at_target: bool
        """Whether to stand still at the target."""

        def __init__(
            self,
            stop_at_target: bool = False,
        ) -> None: ...

    class SetOrientationModeMessage(Message):
        """The message SetOrientationModeMessage.

        Say when to turn.
        """

        orientation_mode: NavigatorInterface.OrientationMode
        """When to turn to the wanted orientation."""

        def __init__(
            self,
            orientation_mode: NavigatorInterface.OrientationMode | int = 0,
        ) -> None: ...

    class ResetParametersMessage(Message):
        """The message ResetParametersMessage.

        Forget all settings, back to those of the start.
        """

    flags: int
    """Abilities: FLAG_ constants joined by bitwise or."""

    x: float
    """Where the robot is: X."""

    y: float
    """Where the robot is: Y."""

    dest_x: float
    """The target: X; 0 without one."""

    dest_y: float
    """The target: Y; 0 without one."""

    dest_ori: float
    """The orientation wanted at the target; 0 without one."""

    dest_dist: float
    """How far the target is."""

    msgid: int
    """Id of the message that is carried out, 0 when there is none."""

    final: bool
    """Whether the last order has come to an end."""

    error_code: int
    """What failed, once final is true: ERROR_ constants joined by bitwise or."""

    max_velocity: float
    """Fastest travel, in metres a second."""

    max_rotation: float
    """Fastest turn, in radians a second."""

    security_distance: float
    """How far to stay away from obstacles."""

    escaping_enabled: bool
    """Whether to escape from an obstacle; stops at it otherwise."""

    drive_mode: DriveMode
    """How the robot may move now."""

    auto_drive_mode: bool
    """Whether the navigator chooses the drive mode itself, each time."""

    stop_at_target: bool
    """Whether to stand still at the target."""

    orientation_mode: OrientationMode
    """When to turn to the wanted orientation."""

    target_frame: str
    """The frame that paths are planned in."""
