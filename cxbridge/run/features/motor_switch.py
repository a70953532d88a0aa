"""The feature `motor-switch` of a run: switches a robot's motor on and off."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext

SECTION = "/clips-motor-switch"


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.motor_switch import MotorSwitchFeature  # noqa: PLC0415

    motor = context.config.get_str(f"{SECTION}/interface-id", default="Robotino")
    return MotorSwitchFeature(context.board, motor)
