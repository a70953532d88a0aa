"""Vectors, rotations and transforms in three dimensions: metres, radians, right-handed.

A vector is ``(x, y, z)``, a quaternion ``(x, y, z, w)``.
"""

from __future__ import annotations

import math
from typing import Final

from msgspec import Struct

from cxbridge.space.tf.errors import InvalidRotationError

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ORIGIN: Final[Vector] = (0.0, 0.0, 0.0)
NO_ROTATION: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)

_LENGTH_TOLERANCE = 0.01  # of the squared length, as in Fawkes
# Above this cosine quaternions are interpolated linearly: the division by the sine of the angle would lose
# precision.
_ALMOST_PARALLEL = 0.9995


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """Return the rotation about z by an angle."""
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def quaternion_yaw(q: Quaternion) -> float:
    """Return the angle about z of a rotation, in [-pi, pi], for a quaternion of any length."""
    x, y, z, w = q
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def normalize(q: Quaternion) -> Quaternion:
    """Return a quaternion normalised to length 1.

    :raises InvalidRotationError: if the quaternion has a NaN, or its squared length differs from 1 by more
        than Fawkes accepts.
    """
    squared_length = sum(component * component for component in q)
    if math.isnan(squared_length):
        raise InvalidRotationError("Quaternion malformed, contains NaN value")
    if abs(squared_length - 1) > _LENGTH_TOLERANCE:
        raise InvalidRotationError(f"Quaternion malformed, magnitude: {squared_length:f}, should be 1.0")
    length = math.sqrt(squared_length)
    x, y, z, w = q
    return (x / length, y / length, z / length, w / length)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation ``b`` followed by ``a``."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse rotation of a quaternion of length 1."""
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return ``v`` rotated by ``q``, a quaternion of length 1."""
    x, y, z, _ = multiply(multiply(q, (*v, 0.0)), conjugate(q))
    return (x, y, z)


def add(a: Vector, b: Vector) -> Vector:
    """Return ``a + b``."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def lerp(a: Vector, b: Vector, ratio: float) -> Vector:
    """Interpolate linearly from ``a`` (ratio 0) to ``b`` (ratio 1)."""
    x, y, z = (p + (q - p) * ratio for p, q in zip(a, b, strict=True))
    return (x, y, z)


def slerp(a: Quaternion, b: Quaternion, ratio: float) -> Quaternion:
    """Interpolate spherically from ``a`` (ratio 0) to ``b`` (ratio 1) on the shorter arc."""
    dot = sum(p * q for p, q in zip(a, b, strict=True))
    # q and -q are the same rotation: a negative product means the longer arc
    if dot < 0:
        b, dot = (-b[0], -b[1], -b[2], -b[3]), -dot
    if dot > _ALMOST_PARALLEL:
        weight_a, weight_b = 1 - ratio, ratio
    else:
        angle = math.acos(dot)
        weight_a = math.sin((1 - ratio) * angle) / math.sin(angle)
        weight_b = math.sin(ratio * angle) / math.sin(angle)
    x, y, z, w = (weight_a * p + weight_b * q for p, q in zip(a, b, strict=True))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / length, y / length, z / length, w / length)


class Transform(Struct, frozen=True):
    """The pose of a frame in its parent, which converts coordinates of the frame to those of the parent.

    :param translation: the frame's origin.
    :param rotation: a quaternion of length 1.
    """

    translation: Vector = ORIGIN
    rotation: Quaternion = NO_ROTATION

    def __mul__(self, other: Transform) -> Transform:
        """Return ``other`` followed by this transform."""
        return Transform(self.apply(other.translation), multiply(self.rotation, other.rotation))

    def apply(self, point: Vector) -> Vector:
        """Return the parent's coordinates of a point in the frame."""
        return add(rotate(self.rotation, point), self.translation)

    def inverse(self) -> Transform:
        """Return the inverse transform."""
        back = conjugate(self.rotation)
        x, y, z = rotate(back, self.translation)
        return Transform((-x, -y, -z), back)
