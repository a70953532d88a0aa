"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from typing import Any

from cxbridge.plugins import Row, always

API = 1  # version of the plug-in interface


def _is_needed_at_start(run: Any) -> bool:
    """Return whether the initialisation requests the robot memory or waits for it."""
    from cxbridge.run.specs import init_mentions  # noqa: PLC0415 - other commands need no specs

    return init_mentions(run.config, run.spec, "robot_memory", "robmem-wait-init")


COMPONENTS = (
    Row(
        "robot-memory",
        "cxbridge_robot_memory.component:RobotMemoryComponent",
        _is_needed_at_start,
        early=always,  # before the executive, whose initialisation waits for the robot memory
        in_replays=True,
    ),
)
FEATURES = (Row("robot_memory", "cxbridge_robot_memory.feature.feature:make_feature"),)
SETTINGS = (Row("robot-memory", "cxbridge_robot_memory.settings:RobotMemorySettings"),)
