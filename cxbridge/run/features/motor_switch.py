"""The feature `motor-switch` of a run: switches a robot's motor on and off."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.motor_switch import MotorSwitchFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    motor = context.config.get_str("/clips-motor-switch/interface-id", default="Robotino")
    return MotorSwitchFeature(context.board, motor)
