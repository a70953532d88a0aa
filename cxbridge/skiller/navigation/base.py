"""A simulated base that turns on the spot and drives straight at limited speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

_ANGLE_ERROR = 1e-9  # radians that count as a rounding error
_LENGTH_ERROR = 1e-9  # metres that count as a rounding error


@dataclass(slots=True)
class Base:
    """The pose and speed of a robot.

    :param x: the x coordinate in metres.
    :param y: the y coordinate in metres.
    :param yaw: the orientation in radians from the x axis, counter-clockwise.
    :param speed: the speed of driving in metres per second, positive.
    :param turn_speed: the speed of turning in radians per second, positive.
    """

    x: float
    y: float
    yaw: float
    speed: float
    turn_speed: float

    def turn_to(self, yaw: float, seconds: float) -> float:
        """Turn towards an orientation by the shorter way.

        :param seconds: the available time.
        :returns: the remaining time; 0 unless the orientation is reached.
        """
        angle = math.remainder(yaw - self.yaw, math.tau)
        reach = self.turn_speed * seconds
        if abs(angle) > reach + _ANGLE_ERROR:
            self.yaw = math.remainder(self.yaw + math.copysign(reach, angle), math.tau)
            return 0.0
        # exactly, so that rounding errors of many steps do not add up
        self.yaw = math.remainder(yaw, math.tau)
        return max(0.0, seconds - abs(angle) / self.turn_speed)

    def approach(self, x: float, y: float, seconds: float) -> float:
        """Turn towards a point and drive to it.

        :param seconds: the available time.
        :returns: the remaining time; 0 unless the point is reached.
        """
        distance = math.hypot(x - self.x, y - self.y)
        if distance <= _LENGTH_ERROR:
            return seconds
        seconds = self.turn_to(math.atan2(y - self.y, x - self.x), seconds)
        reach = self.speed * seconds
        if reach + _LENGTH_ERROR < distance:
            self.x += reach * (x - self.x) / distance
            self.y += reach * (y - self.y) / distance
            return 0.0
        self.x, self.y = x, y
        return max(0.0, seconds - distance / self.speed)
