"""The log of a run on /rosout, and the logs of other nodes."""

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
_NANOSECONDS: Final = 1000  # per microsecond
# levels of rcl_interfaces/msg/Log; 50, FATAL, becomes an error
_SEVERITY: Final = {Level.DEBUG: 10, Level.INFO: 20, Level.WARN: 30, Level.ERROR: 40}


class Rosout(Closing):
    """Publishes log lines on /rosout; a sink of events.

    :param name: the node's name, prefix of component names: ``cxbridge.SkillBoard``.
    :param least: the lowest published level.
    """

    events = (LogLine,)  # event types to subscribe to

    def __init__(self, node: Node, name: str, least: Level = Level.INFO) -> None:
        self._name, self._least = name, least
        self._publisher = node.publisher(TOPIC, _TYPE, PROFILES["rosout"])

    def __call__(self, event: Event) -> None:
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
        self._publisher.close()


def listen(node: Node, take: Callable[[LogLine], None]) -> Callable[[], None]:
    """Call ``take`` for each line on /rosout, kept ones first; return the unsubscribe function."""
    return node.subscribe(
        TOPIC, _TYPE, lambda message: take(_line(message)), PROFILES["rosout"], needs=Right.LOOK
    )


def _line(message: Message) -> LogLine:
    stamp: Mapping[str, int] = message["stamp"]
    levels = [level for level, number in _SEVERITY.items() if number <= message["level"]]
    at_us = stamp["sec"] * MICROSECONDS + stamp["nanosec"] // _NANOSECONDS
    return LogLine(at_us, levels[-1] if levels else Level.DEBUG, message["name"], message["msg"])
