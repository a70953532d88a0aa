"""An environment with the features of this package, on a blackboard."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.config import Configuration
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.features.motor_switch import MotorSwitchFeature
from cxbridge.executive.features.navgraph import NavGraphFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.robot_memory import RobotMemoryFeature
from cxbridge.executive.features.tf import TfFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.space.navgraph import NavGraph
from tests.executive.conftest import Log

CONFIG = """
a:
  uint: 5
  quoted: "7"
  int: -3
  float: 2.5
  bool: yes
  text: some "quoted" text
  hex: 0x10
  empty: []
  names: [x, y]
  numbers: [1, 2]
  maps:
    - name: one
    - name: two
"""


PLUGINS = tuple(name for name in ("cxbridge_protobuf",) if find_spec(name))
"""The installed plug-ins with a feature of Fawkes: the tests of all features have it, too."""

if PLUGINS:
    from protobuf_tests.conftest import PROTOS, _fast_compiler

    __all__ = ["_fast_compiler"]


def plugin_features(*folders: Path) -> list[Feature]:
    """Return the features of the installed plug-ins.

    :param folders: of message definitions, besides those of the plug-in's tests.
    """
    if not PLUGINS:
        return []
    from cxbridge_protobuf.feature import ProtobufFeature
    from cxbridge_protobuf.settings import ProtobufSettings

    return [ProtobufFeature(ProtobufSettings((PROTOS, *folders)) if folders else None)]


@pytest.fixture
def board(bus):
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    yield board
    board.shutdown()


@pytest.fixture
def log(bus):
    return Log(bus)


@pytest.fixture
def memory(bus, board):
    memory = RobotMemory(Configuration.from_text(CONFIG, "test.yaml"), bus.clock, bus, board)
    yield memory
    memory.close()


@pytest.fixture
def manager(bus, board, log, memory):
    config = Configuration.from_text(CONFIG, "test.yaml")
    features = [
        BlackBoardFeature(board),
        ConfigFeature(config),
        PddlParserFeature(),
        RedefineWarningFeature(),
        RobotMemoryFeature(memory),
        *plugin_features(),
        TfFeature(board),
        NavGraphFeature(lambda: NavGraph("Empty")),
        MotorSwitchFeature(board),
    ]
    manager = EnvironmentManager(bus, features)
    yield manager
    manager.close()


@pytest.fixture
def env(manager):
    env = manager.create("executive")
    for feature in ("blackboard", "config"):
        assert manager.request("executive", feature) == "TRUE"
    return env
