"""A base keeps its limits, and its pose does not depend on the division of time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.skiller.navigation.base import Base

metres = st.floats(-100, 100)
angles = st.floats(-10, 10)
slices = st.lists(st.floats(0, 2), min_size=1, max_size=30)


@given(metres, metres, angles, metres, metres, slices, st.floats(0.01, 10), st.floats(0.01, 10))
def test_base_keeps_speed_limits(x, y, yaw, to_x, to_y, times, speed, turn):
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
def test_pose_does_not_depend_on_time_slices(x, y, to_x, to_y, times):
    cut, undivided = (Base(x, y, 0.0, speed=0.3, turn_speed=1.0) for _ in range(2))
    for seconds in times:
        cut.approach(to_x, to_y, seconds)
    undivided.approach(to_x, to_y, math.fsum(times))
    assert (cut.x, cut.y) == pytest.approx((undivided.x, undivided.y), abs=1e-6)
