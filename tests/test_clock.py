"""Real, scaled and virtual time."""

from __future__ import annotations

import time

import pytest

from cxbridge.clock import RealClock, VirtualClock, join_us, make_clock, split_us
from cxbridge.errors import ConfigError


def test_virtual_time_passes_by_sleeping_only():
    clock = VirtualClock(5)
    assert clock.now_us() == 5
    clock.sleep_until(9)
    assert clock.now_us() == 9
    clock.sleep_until(3)
    assert clock.now_us() == 9


def test_real_time_follows_machine_and_never_decreases():
    clock = RealClock()
    first = clock.now_us()
    assert abs(first - time.time() * 1e6) < 5e6
    clock.sleep_until(first + 2000)
    assert clock.now_us() >= first + 2000
    clock.sleep_until(first)


def test_scaled_time_runs_faster():
    clock = RealClock(100)
    start_us, started = clock.now_us(), time.monotonic()
    clock.sleep_until(start_us + 1_000_000)
    assert clock.now_us() >= start_us + 1_000_000
    assert time.monotonic() - started < 0.9


@pytest.mark.parametrize(
    ("spec", "name"), [("virtual", "virtual"), ("real", "real"), ("scaled:2.5", "scaled:2.5")]
)
def test_clock_is_made_by_name(spec, name):
    assert make_clock(spec).name == name


@pytest.mark.parametrize(
    "spec", ["", "fast", "scaled", "scaled:", "scaled:x", "scaled:0", "scaled:-1", "scaled:nan"]
)
def test_unknown_clock_is_an_error(spec):
    with pytest.raises(ConfigError) as caught:
        make_clock(spec)
    assert caught.value.hint


def test_times_of_writers_fit_into_64_bits():
    assert join_us(*split_us(1_500_000_000_250_000)) == 1_500_000_000_250_000
    assert join_us(*split_us(-1)) == -1
    for seconds, microseconds in (
        (2**63 - 1, 2**63 - 1),
        (2**50, 0),
        (2**64 - 1, 2**32 - 1),
        (-(2**63), -(2**63)),
    ):
        joined = join_us(seconds, microseconds)
        assert -(2**63) <= joined < 2**63
        assert join_us(*split_us(joined)) == joined
