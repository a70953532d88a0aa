"""The feature ``motor-switch`` of the RCLL agent: switches a robot's motors. See docs/features.md."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.blackboard.errors import NoWriterError
from cxbridge.errors import CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.run.agent import Run

_LOG_COMPONENT = "ClipsMotorSwitchThread"  # the name of the thread in Fawkes, so that logs can be compared


def make_feature(context: Run) -> MotorSwitchFeature:
    """Return the feature of a run."""
    interface_id = context.config.get_str("/clips-motor-switch/interface-id", default="Robotino")
    return MotorSwitchFeature(context.board, interface_id)


class MotorSwitchFeature(Feature):
    """Provides ``motor-enable`` and ``motor-disable``.

    The functions send ``SetMotorState`` to a MotorInterface, while fawkes-robotino calls a ROS service.

    :param interface_id: the id of the MotorInterface.
    """

    name = "motor-switch"

    def __init__(self, board: BlackBoard, interface_id: str) -> None:
        self._board = board
        self._interface_id = interface_id
        self._motor_interfaces: dict[str, Any] = {}  # by name of the environment

    def init_context(self, env: ClipsEnvironment) -> None:
        env.define("motor-enable", lambda: self._switch_motors(env, is_enabled=True))
        env.define("motor-disable", lambda: self._switch_motors(env, is_enabled=False))

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        motor = self._motor_interfaces.pop(env.name, None)
        if motor is not None:
            motor.close()

    def _switch_motors(self, env: ClipsEnvironment, *, is_enabled: bool) -> None:
        log = env.bus.logger(_LOG_COMPONENT)
        action = "enable" if is_enabled else "disable"
        try:
            motor: Any = self._motor_interfaces.get(env.name)
            if motor is None:
                motor = self._board.open_for_reading(
                    "MotorInterface", self._interface_id, owner=f"CLIPS:{env.name}"
                )
                self._motor_interfaces[env.name] = motor
            message: Any = motor.create_message("SetMotorStateMessage")
            message.motor_state = motor.MOTOR_ENABLED if is_enabled else motor.MOTOR_DISABLED
            motor.msgq_enqueue(message)
        except NoWriterError:
            log.error(f"Failed to {action} motors: no writer of MotorInterface::{self._interface_id}")
        except CxbridgeError as error:
            log.error(f"Failed to {action} motors: {error}")
