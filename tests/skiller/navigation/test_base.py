"""A base keeps its limits, and where it arrives does not depend on how time is cut."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.skiller.navigation.base import Base

metres = st.floats(-100, 100)
angles = st.floats(-10, 10)
slices = st.lists(st.floats(0, 2), min_size=1, max_size=30)


def test_turn_then_drive():
    base = Base(0.0, 0.0, 0.0, speed=0.5, turn=math.pi / 2)
    assert base.approach(0.0, 1.0, 0.5) == 0.0
    assert (base.x, base.y, base.yaw) == pytest.approx((0.0, 0.0, math.pi / 4))
    assert base.approach(0.0, 1.0, 1.5) == 0.0
    assert (base.x, base.y) == pytest.approx((0.0, 0.5))
    assert base.approach(0.0, 1.0, 3.0) == pytest.approx(2.0)
    assert (base.x, base.y, base.yaw) == pytest.approx((0.0, 1.0, math.pi / 2))


def test_the_short_way_round():
    base = Base(0.0, 0.0, 3.0, speed=1.0, turn=1.0)
    assert base.face(-3.0, 1.0) == pytest.approx(1.0 - (2 * math.pi - 6))
    assert base.yaw == -3.0


def test_at_the_target_no_time_passes():
    base = Base(1.0, 2.0, 0.5, speed=1.0, turn=1.0)
    assert base.approach(1.0, 2.0, 0.7) == 0.7
    assert base.face(0.5, 0.7) == pytest.approx(0.7)


@given(metres, metres, angles, metres, metres, slices, st.floats(0.01, 10), st.floats(0.01, 10))
def test_limits_are_kept_whatever_time_does(x, y, yaw, to_x, to_y, times, speed, turn):
    base = Base(x, y, yaw, speed, turn)
    for seconds in times:
        before = (base.x, base.y, base.yaw)
        left = base.approach(to_x, to_y, seconds)
        assert 0.0 <= left <= seconds
        used = seconds - left
        moved = math.hypot(base.x - before[0], base.y - before[1])
        turned = abs(math.remainder(base.yaw - before[2], math.tau))
        assert moved <= speed * used + 1e-6
        assert turned <= turn * used + 1e-6
        assert moved / speed + turned / turn <= used + 1e-6


@given(metres, metres, metres, metres, slices)
def test_where_one_is_does_not_depend_on_how_time_is_cut(x, y, to_x, to_y, times):
    cut, whole = (Base(x, y, 0.0, speed=0.3, turn=1.0) for _ in range(2))
    for seconds in times:
        cut.approach(to_x, to_y, seconds)
    whole.approach(to_x, to_y, math.fsum(times))
    assert (cut.x, cut.y) == pytest.approx((whole.x, whole.y), abs=1e-6)


@given(angles)
def test_the_quaternion_turns_about_z(yaw):
    x, y, z, w = Base(0.0, 0.0, yaw, 1.0, 1.0).quaternion
    assert (x, y) == (0.0, 0.0)
    assert z * z + w * w == pytest.approx(1.0)
    assert math.remainder(2 * math.atan2(z, w) - yaw, math.tau) == pytest.approx(0.0, abs=1e-9)
