"""Times on pages never decrease."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import MICROSECONDS
from cxbridge.history.monotonic import MonotonicClock


@given(st.lists(st.integers(-(2**62), 2**62)))
def test_times_never_decrease_and_begin_at_zero(times):
    clock = MonotonicClock()
    steady_times = [clock.advance_to(time) for time in times]
    assert steady_times == sorted(steady_times)
    assert steady_times[:1] == [0][: len(times)]


@given(st.lists(st.integers(0, 2**40), min_size=1))
def test_increasing_times_are_unchanged(times):
    times.sort()
    clock = MonotonicClock()
    assert [clock.advance_to(time) for time in times] == [time - times[0] for time in times]
    assert clock.describe_setbacks() == []


@pytest.mark.parametrize(
    ("times", "shown", "warning"),
    [
        ([10, 20, 5, 6], [0, 10, 10, 11], "set back by 15.000 s at 10.000 s"),
        ([0, 9, 0, 9, 0], [0, 9, 9, 18, 18], "2 times"),
        ([0, 1, 0.000_005, 1.000_003], [0, 1, 1, 1.000_003], ""),  # events in a slightly different order
    ],
)
def test_clock_set_back_continues_from_last_time(times, shown, warning):
    clock = MonotonicClock()
    assert [clock.advance_to(round(time * MICROSECONDS)) / MICROSECONDS for time in times] == shown
    assert warning in "".join(clock.describe_setbacks())
    assert bool(warning) == bool(clock.setbacks)
