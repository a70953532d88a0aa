"""Publishes the log lines of a run on /rosout."""

from __future__ import annotations

from typing import Final

from cxbridge.closing import Closing
from cxbridge.events import Event, Level, LogLine
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import us_to_stamp

ROSOUT_TOPIC: Final = "/rosout"
LOG_TYPE: Final = "rcl_interfaces/msg/Log"
# Levels of rcl_interfaces/msg/Log in ascending order. Level has no FATAL (50), which becomes an error.
_SEVERITIES: Final = {Level.DEBUG: 10, Level.INFO: 20, Level.WARN: 30, Level.ERROR: 40}


class RosoutPublisher(Closing):
    """Publishes log lines on /rosout. The event bus calls the instance with each event.

    :param name: the node's name, which precedes the component's name: ``cxbridge.SkillBoard``.
    :param min_level: the lowest published level.
    """

    event_types = (LogLine,)  # the event types to request from the event bus

    def __init__(self, node: Node, name: str, min_level: Level = Level.INFO) -> None:
        self._name, self._min_level = name, min_level
        self._publisher = node.create_publisher(ROSOUT_TOPIC, LOG_TYPE, PROFILES["rosout"])

    def __call__(self, event: Event) -> None:
        if isinstance(event, LogLine) and _SEVERITIES[event.level] >= _SEVERITIES[self._min_level]:
            self._publisher.publish(make_log_message(event, f"{self._name}.{event.component}"))

    def close(self) -> None:
        self._publisher.close()


def make_log_message(line: LogLine, component: str) -> Message:
    """Return a log line as a message."""
    return {
        "stamp": us_to_stamp(line.time_us),
        "level": _SEVERITIES[line.level],
        "name": _to_ros_text(component),
        "msg": _to_ros_text(line.text),
    }


def _to_ros_text(text: str) -> str:
    """Return a text without NULs and lone surrogates, which ROS strings cannot contain."""
    return text.replace("\0", "").encode("utf-8", "replace").decode()


def find_level(severity: int) -> Level:
    """Return the highest level that does not exceed a severity; DEBUG if the severity is below all levels."""
    levels = [level for level, number in _SEVERITIES.items() if number <= severity]
    return levels[-1] if levels else Level.DEBUG
