"""The log of a run on /rosout, where the tools of ROS show it, and the logs of other nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.events import Event, Level, LogLine
from cxbridge.rights import Right
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES

TOPIC: Final = "/rosout"
_TYPE: Final = "rcl_interfaces/msg/Log"
_NANOSECONDS: Final = 1000
_SEVERITY: Final = {Level.DEBUG: 10, Level.INFO: 20, Level.WARN: 30, Level.ERROR: 40}
"""The numbers of rcl_interfaces/msg/Log; 50, FATAL, is an error here."""


class Rosout(Closing):
    """Sends log lines to /rosout; a sink of them.

    :param name: the node's; that of the component follows: ``cxbridge.SkillBoard``.
    :param least: lines below this level are not sent.
    """

    events = (LogLine,)
    """The events that the component listens to."""

    def __init__(self, node: Node, name: str, least: Level = Level.INFO) -> None:
        self._name, self._least = name, least
        self._publisher = node.publisher(TOPIC, _TYPE, PROFILES["rosout"])

    def __call__(self, event: Event) -> None:
        """Send a log line."""
        if isinstance(event, LogLine) and _SEVERITY[event.level] >= _SEVERITY[self._least]:
            seconds, rest = divmod(event.time_us, MICROSECONDS)
            self._publisher.publish(
                {
                    "stamp": {"sec": seconds, "nanosec": rest * _NANOSECONDS},
                    "level": _SEVERITY[event.level],
                    "name": f"{self._name}.{event.component}",
                    "msg": event.text,
                }
            )

    def close(self) -> None:
        """Send no more."""
        self._publisher.close()


def listen(node: Node, take: Callable[[LogLine], None]) -> Callable[[], None]:
    """Call ``take`` for each line on /rosout, the last ones before too; return what ends that."""
    return node.subscribe(
        TOPIC, _TYPE, lambda message: take(_line(message)), PROFILES["rosout"], needs=Right.LOOK
    )


def _line(message: Message) -> LogLine:
    stamp: Mapping[str, int] = message["stamp"]
    levels = [level for level, number in _SEVERITY.items() if number <= message["level"]]
    at_us = stamp["sec"] * MICROSECONDS + stamp["nanosec"] // _NANOSECONDS
    return LogLine(at_us, levels[-1] if levels else Level.DEBUG, message["name"], message["msg"])
