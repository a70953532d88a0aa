"""The functions of the feature `motor-switch`."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.events import Level
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_rcll.motor_switch import MotorSwitchFeature
from tests.executive.conftest import bus, log

__all__ = ["bus", "log"]  # fixtures


@pytest.fixture
def board(bus):
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    yield board
    board.shutdown()


@pytest.fixture
def env(bus, board, log):
    manager = EnvironmentManager(bus, [MotorSwitchFeature(board, "Robotino")])
    env = manager.create("executive")
    assert manager.request("executive", "motor-switch") == "TRUE"
    yield env
    manager.close()


def test_writer_gets_motor_states(env, board):
    with board.open_for_writing("MotorInterface", "Robotino", owner="motor") as motor:
        for function, state in (
            ("motor-disable", motor.MOTOR_DISABLED),
            ("motor-enable", motor.MOTOR_ENABLED),
        ):
            env.call(function)
            message = motor.msgq_first()
            assert (message.type, message.motor_state) == ("SetMotorStateMessage", state)
            motor.msgq_pop()


@pytest.mark.parametrize("verb", ["enable", "disable"])
def test_missing_writer_is_error(env, log, verb):
    env.call(f"motor-{verb}")
    assert log.texts(Level.ERROR) == [f"Failed to {verb} motors: no writer of MotorInterface::Robotino"]
