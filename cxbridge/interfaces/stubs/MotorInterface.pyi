"""The interface type MotorInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class MotorInterface(Interface):
    """The interface type MotorInterface.

    A drive with three wheels that moves in any direction. Metres, radians, seconds.
    """

    MOTOR_ENABLED: ClassVar[int]
    """Orders move the robot."""

    MOTOR_DISABLED: ClassVar[int]
    """Orders are taken, and nothing moves."""

    DRIVE_MODE_RPM: ClassVar[int]
    """Each wheel for itself."""

    DRIVE_MODE_TRANS: ClassVar[int]
    """Along a line."""

    DRIVE_MODE_ROT: ClassVar[int]
    """On the spot."""

    DRIVE_MODE_TRANS_ROT: ClassVar[int]
    """Along a curve."""

    DRIVE_MODE_ORBIT: ClassVar[int]
    """Around a point."""

    DRIVE_MODE_LINE_TRANS_ROT: ClassVar[int]
    """Along a line, turning."""

    class SetMotorStateMessage(Message):
        """The message SetMotorStateMessage.

        Switch the motor on or off.
        """

        motor_state: int
        """One of the MOTOR_ constants."""

        def __init__(
            self,
            motor_state: int = 0,
        ) -> None: ...

    class AcquireControlMessage(Message):
        """The message AcquireControlMessage.

        Take control, whoever has it.
        """

        controller: int
        """Serial of the instance whose orders are heeded."""

        controller_thread_name: str
        """Name of the controlling thread, for people."""

        def __init__(
            self,
            controller: int = 0,
            controller_thread_name: str = "",
        ) -> None: ...

    class ResetOdometryMessage(Message):
        """The message ResetOdometryMessage.

        Begin odometry anew at zero.
        """

    class SetOdometryMessage(Message):
        """The message SetOdometryMessage.

        Let odometry go on from a given pose.
        """

        x: float
        """Position: X."""

        y: float
        """Position: Y."""

        odometry_orientation: float
        """Orientation."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            odometry_orientation: float = 0.0,
        ) -> None: ...

    class DriveRPMMessage(Message):
        """The message DriveRPMMessage.

        Drive each wheel for itself; for tests of the hardware.
        """

        front_right: float
        """Turns a minute at the front right."""

        front_left: float
        """Turns a minute at the front left."""

        rear: float
        """Turns a minute at the back."""

        def __init__(
            self,
            front_right: float = 0.0,
            front_left: float = 0.0,
            rear: float = 0.0,
        ) -> None: ...

    class GotoMessage(Message):
        """The message GotoMessage.

        Go to a pose seen from here.
        """

        x: float
        """How far to the front."""

        y: float
        """How far to the left."""

        phi: float
        """How to turn."""

        time_sec: float
        """How long it may take."""

        def __init__(
            self,
            x: float = 0.0,
            y: float = 0.0,
            phi: float = 0.0,
            time_sec: float = 0.0,
        ) -> None: ...

    class TransMessage(Message):
        """The message TransMessage.

        Drive along a line.
        """

        vx: float
        """Velocity to the front."""

        vy: float
        """Velocity to the left."""

        def __init__(
            self,
            vx: float = 0.0,
            vy: float = 0.0,
        ) -> None: ...

    class RotMessage(Message):
        """The message RotMessage.

        Turn on the spot.
        """

        omega: float
        """Velocity of the turn."""

        def __init__(
            self,
            omega: float = 0.0,
        ) -> None: ...

    class TransRotMessage(Message):
        """The message TransRotMessage.

        Drive and turn: makes a curve, as the velocities are those seen from the robot.
        """

        vx: float
        """Velocity to the front."""

        vy: float
        """Velocity to the left."""

        omega: float
        """Velocity of the turn."""

        def __init__(
            self,
            vx: float = 0.0,
            vy: float = 0.0,
            omega: float = 0.0,
        ) -> None: ...

    class OrbitMessage(Message):
        """The message OrbitMessage.

        Circle around a point and keep the orientation.
        """

        px: float
        """The point: X."""

        py: float
        """The point: Y."""

        omega: float
        """Velocity of the circling."""

        def __init__(
            self,
            px: float = 0.0,
            py: float = 0.0,
            omega: float = 0.0,
        ) -> None: ...

    class LinTransRotMessage(Message):
        """The message LinTransRotMessage.

        Drive along a line and turn on the way.
        """

        vx: float
        """Velocity to the front."""

        vy: float
        """Velocity to the left."""

        omega: float
        """Velocity of the turn."""

        def __init__(
            self,
            vx: float = 0.0,
            vy: float = 0.0,
            omega: float = 0.0,
        ) -> None: ...

    motor_state: int
    """One of the MOTOR_ constants."""

    drive_mode: int
    """One of the DRIVE_MODE_ constants."""

    right_rpm: int
    """Turns a minute of the wheel at the front right."""

    rear_rpm: int
    """Turns a minute of the wheel at the back."""

    left_rpm: int
    """Turns a minute of the wheel at the front left."""

    odometry_path_length: float
    """How far it has gone since odometry was reset."""

    odometry_position_x: float
    """Where it has come to since then: X."""

    odometry_position_y: float
    """Where it has come to since then: Y."""

    odometry_orientation: float
    """How it has turned since then."""

    vx: float
    """Velocity to the front."""

    vy: float
    """Velocity to the left."""

    omega: float
    """Velocity of the turn."""

    des_vx: float
    """Velocity to the front that was asked for."""

    des_vy: float
    """Velocity to the left that was asked for."""

    des_omega: float
    """Velocity of the turn that was asked for."""

    controller: int
    """Serial of the instance whose orders are heeded."""

    controller_thread_name: str
    """Name of the controlling thread, for people."""
