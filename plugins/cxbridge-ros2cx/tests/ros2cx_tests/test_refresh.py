"""When the executive thinks."""

from __future__ import annotations

from cxbridge.clock import VirtualClock
from cxbridge_ros2cx.refresh import RefreshTimer


def advance(clock, us):
    clock.sleep_until(clock.now_us() + us)


def test_the_first_time_is_a_period_after_the_start():
    clock = VirtualClock()
    timer = RefreshTimer(clock, 1_000_000)
    advance(clock, 999_999)
    assert not timer.advance_if_due()
    advance(clock, 1)
    assert timer.advance_if_due()
    assert not timer.advance_if_due()


def test_loops_that_do_not_divide_the_period_shift_nothing():
    clock = VirtualClock()
    timer = RefreshTimer(clock, 1_000_000)
    times = []
    start = clock.now_us()
    for _ in range(100):
        advance(clock, 33_333)
        if timer.advance_if_due():
            times.append((clock.now_us() - start) // 1_000_000)
    assert times == [1, 2, 3]


def test_missed_times_are_not_made_up_for():
    clock = VirtualClock()
    timer = RefreshTimer(clock, 1_000_000)
    advance(clock, 3_500_000)
    assert [timer.advance_if_due(), timer.advance_if_due()] == [True, False]
    advance(clock, 500_000)
    assert timer.advance_if_due()


def test_a_callback_that_blocks_past_the_next_time_brings_it_at_once():
    clock = VirtualClock()
    timer = RefreshTimer(clock, 1_000_000)
    advance(clock, 1_000_000)
    assert timer.advance_if_due()
    timer.record_blocking(0.9)
    assert not timer.advance_if_due()
    timer.record_blocking(1.0)
    assert [timer.advance_if_due(), timer.advance_if_due()] == [True, False]
