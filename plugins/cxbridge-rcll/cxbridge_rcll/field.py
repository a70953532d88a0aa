"""Geometry of the field: zones, the sides of machines, and distances."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from cxbridge.executive.host.values import Value

# A zone such as ``C-Z42`` or ``M_Z42``: the half, the column and the row.
_ZONE: Final = re.compile(r"([CM])[-_]Z(\d)(\d)")
# A machine with an optional side, such as ``C-BS-INPUT``, or the place to wait for it, ``WAIT-C-BS-I``.
_MACHINE: Final = re.compile(r"(?:WAIT-)?([CM]-(?:BS|DS|SS|CS\d|RS\d))(?:-(INPUT|OUTPUT|I|O))?")
_AT_MACHINE_M: Final = 0.75  # metres from the centre of a machine to a robot that works there

_WAITING_M: Final = 1.5  # metres from the centre of a machine to a robot that waits for it
_ENTRY_M: Final = (4.5, 0.5)  # the place of the first robot; the next robots are a metre apart


class Pose(NamedTuple):
    """The pose of a robot.

    :param x: the metres along the field; negative in magenta's half.
    :param y: the metres across the field.
    :param yaw: the direction in radians.
    """

    x: float
    y: float
    yaw: float = 0.0

    def distance(self, other: Pose) -> float:
        """Return the distance to another pose in metres."""
        return math.hypot(self.x - other.x, self.y - other.y)


def entry(robot: int) -> Pose:
    """Return the start pose of a cyan robot.

    :param robot: the number of the robot, from 1.
    """
    x, y = _ENTRY_M
    return Pose(x + robot - 1, y, math.pi / 2)


class Field:
    """The field.

    :param machines: returns the slots of the referee's facts about machines.
    """

    def __init__(self, machines: Callable[[], Iterable[dict[str, Value]]]) -> None:
        self._machines = machines

    def find(self, place: str) -> Pose | None:
        """Return the pose of a place in a skill's parameters; None if unknown."""
        zone = _ZONE.fullmatch(place)
        if zone is not None:
            return _centre(*zone.groups())
        machine = _MACHINE.fullmatch(place)
        if machine is None:
            return None
        # Skills that name no side mean the input.
        metres = _WAITING_M if place.startswith("WAIT") else _AT_MACHINE_M
        return self._pose_before(machine[1], (machine[2] or "I")[0], metres)

    def _pose_before(self, name: str, side: str, metres: float) -> Pose | None:
        slots = next((machine for machine in self._machines() if machine["name"] == name), None)
        zone = None if slots is None else _ZONE.fullmatch(str(slots["zone"]))
        if slots is None or zone is None:
            return None
        rotation = slots["rotation"]
        degrees = rotation if isinstance(rotation, int | float) else 0
        centre, yaw = _centre(*zone.groups()), math.radians(degrees)
        # The input is on the side to which the machine's rotation points; a robot there looks back at it.
        sign = 1 if side == "I" else -1
        x, y = centre.x + sign * metres * math.cos(yaw), centre.y + sign * metres * math.sin(yaw)
        return Pose(x, y, yaw + (math.pi if sign > 0 else 0.0))


def _centre(half: str, column: str, row: str) -> Pose:
    """Return the centre of a zone; zones have a width of a metre."""
    x = int(column) - 0.5
    return Pose(-x if half == "M" else x, int(row) - 0.5)
