"""Times on pages never go back."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.history.steady import MIN_SETBACK_US, SteadyClock


@given(st.lists(st.integers(-(2**62), 2**62)))
def test_times_never_decrease_and_begin_at_zero(times):
    clock = SteadyClock()
    seen = [clock.advance_to(time) for time in times]
    assert seen == sorted(seen)
    assert seen[:1] == [0][: len(times)]


@given(st.lists(st.integers(0, 2**40), min_size=1))
def test_a_clock_that_goes_on_is_shown_as_it_is(times):
    times.sort()
    clock = SteadyClock()
    assert [clock.advance_to(time) for time in times] == [time - times[0] for time in times]
    assert clock.describe_setbacks() == []


def test_a_clock_that_was_set_back_goes_on_from_there():
    clock = SteadyClock()
    times = [10_000_000, 20_000_000, 5_000_000, 6_000_000]
    assert [clock.advance_to(time) for time in times] == [0, 10_000_000, 10_000_000, 11_000_000]
    assert "set back by 15.000 s at 10.000 s" in clock.describe_setbacks()[0]


def test_events_that_overtook_each_other_are_no_step():
    clock = SteadyClock()
    assert [clock.advance_to(time) for time in (0, MIN_SETBACK_US, 5, MIN_SETBACK_US + 3)] == [
        0,
        MIN_SETBACK_US,
        MIN_SETBACK_US,
        MIN_SETBACK_US + 3,
    ]
    assert clock.describe_setbacks() == []


def test_several_steps_are_counted():
    clock = SteadyClock()
    for time in (0, 9_000_000, 0, 9_000_000, 0):
        clock.advance_to(time)
    assert "2 times" in clock.describe_setbacks()[0]
