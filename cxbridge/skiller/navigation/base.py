"""A simulated base that turns on the spot and drives straight at limited speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

_ANGLE = 1e-9  # radians and metres that count as rounding errors
_LENGTH = 1e-9


@dataclass(slots=True)
class Base:
    """The pose and speed of a robot.

    :param x: metres.
    :param y: metres.
    :param yaw: the orientation in radians from the x axis, counter-clockwise.
    :param speed: metres per second, positive.
    :param turn: radians per second, positive.
    """

    x: float
    y: float
    yaw: float
    speed: float
    turn: float

    def face(self, yaw: float, seconds: float) -> float:
        """Turn towards an orientation by the shorter way.

        :param seconds: the available time.
        :returns: the remaining time; 0 unless the orientation is reached.
        """
        angle = math.remainder(yaw - self.yaw, math.tau)
        reach = self.turn * seconds
        if abs(angle) > reach + _ANGLE:
            self.yaw = math.remainder(self.yaw + math.copysign(reach, angle), math.tau)
            return 0.0
        # exactly, so that rounding errors of many steps do not add up
        self.yaw = math.remainder(yaw, math.tau)
        return max(0.0, seconds - abs(angle) / self.turn)

    def approach(self, x: float, y: float, seconds: float) -> float:
        """Turn towards a point and drive to it.

        :param seconds: the available time.
        :returns: the remaining time; 0 unless the point is reached.
        """
        distance = math.hypot(x - self.x, y - self.y)
        if distance <= _LENGTH:
            return seconds
        seconds = self.face(math.atan2(y - self.y, x - self.x), seconds)
        reach = self.speed * seconds
        if reach + _LENGTH < distance:
            self.x += reach * (x - self.x) / distance
            self.y += reach * (y - self.y) / distance
            return 0.0
        self.x, self.y = x, y
        return max(0.0, seconds - distance / self.speed)

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """The orientation as x, y, z, w."""
        return (0.0, 0.0, math.sin(self.yaw / 2), math.cos(self.yaw / 2))
