"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMMANDS = (Row("ros2", "cxbridge_ros2.cli.ros2", section="Blackboard"),)
FORMATS = (Row("rosbag", "cxbridge_ros2.bags.formats"),)
