"""The log of a run on /rosout, and the lines of other nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.closing import Closing
from cxbridge.events import Event, Level, LogLine
from cxbridge.rights import Right
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import microseconds_of, stamp_of

TOPIC: Final = "/rosout"
LOG_TYPE: Final = "rcl_interfaces/msg/Log"
# levels of rcl_interfaces/msg/Log; 50, FATAL, becomes an error
_SEVERITY: Final = {Level.DEBUG: 10, Level.INFO: 20, Level.WARN: 30, Level.ERROR: 40}


class Rosout(Closing):
    """Publishes log lines on /rosout; a sink of events.

    :param name: the node's name, prefix of component names: ``cxbridge.SkillBoard``.
    :param lowest: the lowest published level.
    """

    events = (LogLine,)  # event types to subscribe to

    def __init__(self, node: Node, name: str, lowest: Level = Level.INFO) -> None:
        self._name, self._lowest = name, lowest
        self._publisher = node.publisher(TOPIC, LOG_TYPE, PROFILES["rosout"])

    def __call__(self, event: Event) -> None:
        if isinstance(event, LogLine) and _SEVERITY[event.level] >= _SEVERITY[self._lowest]:
            self._publisher.publish(log_message(event, f"{self._name}.{event.component}"))

    def close(self) -> None:
        self._publisher.close()


def log_message(line: LogLine, component: str) -> Message:
    """Return a log line as a message."""
    return {
        "stamp": stamp_of(line.time_us),
        "level": _SEVERITY[line.level],
        "name": _ros_text(component),
        "msg": _ros_text(line.text),
    }


def _ros_text(text: str) -> str:
    """Return a text without NULs and lone surrogates, which a string of ROS cannot have."""
    return text.replace("\0", "").encode("utf-8", "replace").decode()


def listen(node: Node, take: Callable[[LogLine], None]) -> Callable[[], None]:
    """Call ``take`` for each line on /rosout, latched lines first; return the function that unsubscribes."""

    def callback(message: Message) -> None:
        level = level_of(message["level"])
        take(LogLine(microseconds_of(message["stamp"]), level, message["name"], message["msg"]))

    return node.subscribe(TOPIC, LOG_TYPE, callback, PROFILES["rosout"], needs=Right.LOOK)


def level_of(severity: int) -> Level:
    """Return the level of a message, whose severity may be any number."""
    levels = [level for level, number in _SEVERITY.items() if number <= severity]
    return levels[-1] if levels else Level.DEBUG
