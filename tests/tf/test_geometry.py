"""Rotations and transforms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.space.tf.errors import InvalidRotationError
from cxbridge.space.tf.geometry import (
    Transform,
    normalize,
    quaternion_from_yaw,
    quaternion_yaw,
    slerp,
)

angles = st.floats(-3.1, 3.1)
metres = st.floats(-100, 100)


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the rotation about x by ``roll``, then about y by ``pitch``, then about z by ``yaw``."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


rotations = st.builds(quaternion_from_rpy, angles, st.floats(-1.5, 1.5), angles)
transforms = st.builds(Transform, st.tuples(metres, metres, metres), rotations)


@given(angles)
def test_the_yaw_comes_back(yaw: float):
    assert quaternion_yaw(quaternion_from_yaw(yaw)) == pytest.approx(yaw)


@given(transforms, st.tuples(metres, metres, metres))
def test_there_and_back(transform: Transform, point: tuple[float, float, float]):
    assert transform.inverse().apply(transform.apply(point)) == pytest.approx(point, abs=1e-9)


@given(transforms, transforms, st.tuples(metres, metres, metres))
def test_one_after_the_other(a: Transform, b: Transform, point: tuple[float, float, float]):
    assert (a * b).apply(point) == pytest.approx(a.apply(b.apply(point)), abs=1e-9)


def test_halfway_is_half_the_angle():
    assert quaternion_yaw(slerp(quaternion_from_yaw(0), quaternion_from_yaw(1), 0.5)) == pytest.approx(0.5)


def test_the_shorter_way_is_taken():
    a, b = quaternion_from_yaw(3.0), quaternion_from_yaw(-3.0)
    assert abs(quaternion_yaw(slerp(a, b, 0.5))) == pytest.approx(math.pi)


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0), (0.0, 0.0, math.nan, 1.0)])
def test_what_is_no_rotation_is_refused(q):
    with pytest.raises(InvalidRotationError, match="Quaternion malformed"):
        normalize(q)
