"""The geometry of the field: zones, the sides of machines, and distances."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Any, Final, NamedTuple

# a zone such as `C-Z42` or `M_Z42`: the half (C: cyan, M: magenta), the column and the row
_ZONE_PATTERN: Final = re.compile(r"([CM])[-_]Z(\d)(\d)")
# a machine with an optional side, such as `C-BS-INPUT`, or the location to wait for the machine,
# `WAIT-C-BS-I`
_MACHINE_PATTERN: Final = re.compile(r"(?:WAIT-)?([CM]-(?:BS|DS|SS|CS\d|RS\d))(?:-(INPUT|OUTPUT|I|O))?")
_WORK_DISTANCE_M: Final = 0.75  # from the centre of a machine to a robot that uses the machine
_WAIT_DISTANCE_M: Final = 1.5  # from the centre of a machine to a robot that waits for the machine
_FIRST_ENTRY_M: Final = (4.5, 0.5)  # the location of the first robot; the robots are a metre apart


class Pose(NamedTuple):
    """The pose of a robot, or the centre of a machine or zone.

    :param x: the metres along the field; negative in magenta's half.
    :param y: the metres across the field.
    :param yaw: the direction in radians; 0.0 for a centre.
    """

    x: float
    y: float
    yaw: float = 0.0

    def distance_m(self, other: Pose) -> float:
        """Return the distance to another pose."""
        return math.hypot(self.x - other.x, self.y - other.y)


def entry_pose(robot_number: int) -> Pose:
    """Return the start pose of a cyan robot.

    :param robot_number: the number of the robot, from 1.
    """
    x, y = _FIRST_ENTRY_M
    return Pose(x + robot_number - 1, y, math.pi / 2)


class Field:
    """The zones of the field, and the machines where the referee has placed them.

    :param list_machines: returns the slots of the referee's facts about machines.
    """

    def __init__(self, list_machines: Callable[[], Iterable[dict[str, Any]]]) -> None:
        self._list_machines = list_machines

    def find_pose(self, location: str) -> Pose | None:
        """Return the pose at a location in a skill's parameters; None if the location is unknown."""
        zone_match = _ZONE_PATTERN.fullmatch(location)
        if zone_match is not None:
            return _zone_centre(*zone_match.groups())
        machine_match = _MACHINE_PATTERN.fullmatch(location)
        if machine_match is None:
            return None
        name, side = machine_match.groups(default="INPUT")  # a skill without a side means the input
        distance_m = _WAIT_DISTANCE_M if location.startswith("WAIT") else _WORK_DISTANCE_M
        return self._pose_before(name, distance_m, is_input=side.startswith("I"))

    def _pose_before(self, name: str, distance_m: float, *, is_input: bool) -> Pose | None:
        """Return the pose of a robot before a side of a machine; None if the machine's zone is unknown."""
        slots = next((slots for slots in self._list_machines() if slots["name"] == name), None)
        zone_match = None if slots is None else _ZONE_PATTERN.fullmatch(str(slots["zone"]))
        if slots is None or zone_match is None:
            return None
        centre, yaw = _zone_centre(*zone_match.groups()), math.radians(slots["rotation"])
        # The rotation of a machine points to its input. A robot there looks in the opposite direction.
        sign = 1 if is_input else -1
        x, y = centre.x + sign * distance_m * math.cos(yaw), centre.y + sign * distance_m * math.sin(yaw)
        return Pose(x, y, yaw + (math.pi if is_input else 0.0))


def _zone_centre(half: str, column: str, row: str) -> Pose:
    """Return the centre of a zone; zones are squares with sides of a metre."""
    x = int(column) - 0.5
    return Pose(-x if half == "M" else x, int(row) - 0.5)
