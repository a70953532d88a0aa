"""When the executive thinks."""

from __future__ import annotations

import pytest

from cxbridge.clock import VirtualClock
from cxbridge_ros2cx.refresh import RefreshTimer

SECOND_US = 1_000_000


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.mark.parametrize(
    ("steps_us", "due"),
    [
        ([999_999, 1, 0], [1]),  # the first time is a period after the start
        ([3_500_000, 0, 500_000], [0, 2]),  # missed times are not made up for
        ([33_333] * 100, [30, 60, 90]),  # loops that do not divide the period shift nothing
    ],
)
def test_the_timer_is_due_once_a_period(clock, steps_us, due):
    timer = RefreshTimer(clock, SECOND_US)
    found = []
    for number, step_us in enumerate(steps_us):
        clock.sleep_until(clock.now_us() + step_us)
        found += [number] * timer.advance_if_due()
    assert found == due


def test_a_callback_that_blocks_past_the_next_time_brings_it_at_once(clock):
    timer = RefreshTimer(clock, SECOND_US)
    timer.record_blocking(0.9)
    assert not timer.advance_if_due()
    timer.record_blocking(1.0)
    assert [timer.advance_if_due(), timer.advance_if_due()] == [True, False]
