"""The clock of ``--clock ros2``, which follows the topic /clock."""

from __future__ import annotations

from pathlib import Path

from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.rights import EVERYTHING
from cxbridge_ros2.node import Node
from cxbridge_ros2.sim_time import SimTimeClock
from cxbridge_ros2.trees import node_settings

_TREE = "/ros2/clock"


def make_clock(config: Configuration, folder: Path) -> Clock:
    """Make a clock that follows the simulated time of ROS 2.

    :param folder: the folder of the configuration, base of relative paths.
    """
    _, settings = node_settings(config, _TREE, (), folder, "the clock of ROS 2")

    def join() -> Node:
        return settings.join("cxbridge_clock", settings.definitions(), None, EVERYTHING)

    return SimTimeClock(join)
