"""The refresh timer of the executive."""

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
        ([999_999, 1, 0], [1]),  # the timer is first due a period after the start
        ([3_500_000, 0, 500_000], [0, 2]),  # the timer skips missed periods
        ([33_333] * 100, [30, 60, 90]),  # loops that do not divide the period cause no drift
    ],
)
def test_timer_is_due_once_in_each_period(clock, steps_us, due):
    timer = RefreshTimer(clock, SECOND_US)
    due_steps = []
    for number, step_us in enumerate(steps_us):
        clock.sleep_until(clock.now_us() + step_us)
        due_steps += [number] * timer.advance_if_due()
    assert due_steps == due


def test_blocking_callback_makes_timer_due_immediately(clock):
    timer = RefreshTimer(clock, SECOND_US)
    timer.record_blocking(0.9)
    assert not timer.advance_if_due()
    timer.record_blocking(1.0)
    assert [timer.advance_if_due(), timer.advance_if_due()] == [True, False]
