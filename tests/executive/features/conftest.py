"""An environment with the features of this package, on a blackboard."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.features.navgraph import NavGraphFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.tf import TfFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.space.navgraph import NavGraph

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


HAS_PROTOBUF = find_spec("cxbridge_protobuf") is not None
HAS_MOTOR_SWITCH = find_spec("cxbridge_rcll") is not None
HAS_ROBOT_MEMORY = find_spec("cxbridge_robot_memory") is not None
"""Whether the plug-ins with features of Fawkes are installed: the tests of all features have these, too."""

if HAS_PROTOBUF:
    from protobuf_tests.conftest import PROTOS, _fast_compiler

    __all__ = ["_fast_compiler"]


def plugin_features(bus: EventBus, board: BlackBoard, *folders: Path, store: Any = None) -> list[Feature]:
    """Return the features of the installed plug-ins.

    :param board: the blackboard of the features.
    :param folders: of message definitions, besides those of the plug-in's tests.
    :param store: the store of the robot memory, by default a new store.
    """
    features: list[Feature] = []
    if HAS_PROTOBUF:
        from cxbridge_protobuf.feature import ProtobufFeature
        from cxbridge_protobuf.settings import ProtobufSettings

        features.append(ProtobufFeature(ProtobufSettings((PROTOS, *folders)) if folders else None))
    if HAS_MOTOR_SWITCH:
        from cxbridge_rcll.motor_switch import MotorSwitchFeature

        features.append(MotorSwitchFeature(board, "Robotino"))
    if HAS_ROBOT_MEMORY:
        from cxbridge_robot_memory.feature.feature import RobotMemoryFeature
        from cxbridge_robot_memory.memory import RobotMemory

        make_embedded = None if store is None else lambda _settings: store
        memory = RobotMemory(Configuration(), bus.clock, bus, board, make_embedded=make_embedded)
        features.append(RobotMemoryFeature(memory))
    return features


@pytest.fixture
def board(bus):
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    yield board
    board.shutdown()


@pytest.fixture
def manager(bus, board, log):
    config = Configuration.from_text(CONFIG, "test.yaml")
    features = [
        BlackBoardFeature(board),
        ConfigFeature(config),
        PddlParserFeature(),
        RedefineWarningFeature(),
        *plugin_features(bus, board),
        TfFeature(board),
        NavGraphFeature(lambda: NavGraph("Empty")),
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
