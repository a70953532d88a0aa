"""Quantiles and intervals compared with numpy, scipy and simulation."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge_explore.sweep.statistics import mean_interval, proportion_interval, summarize_sample

VALUES = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60)


@given(VALUES)
def test_quantiles_equal_those_of_numpy(values):
    numpy = pytest.importorskip("numpy")
    result = summarize_sample(values)
    assert result is not None
    shares = {"min": 0, "p05": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95, "max": 1}
    expected = {name: numpy.quantile(values, share) for name, share in shares.items()}
    assert result == pytest.approx(expected | {"mean": numpy.mean(values)}, abs=1e-6)


@given(st.integers(1, 400).flatmap(lambda total: st.tuples(st.integers(0, total), st.just(total))))
def test_proportion_interval_equals_that_of_wilson(counts):
    stats = pytest.importorskip("scipy.stats")
    count, total = counts
    result = proportion_interval(count, total)
    expected = stats.binomtest(count, total).proportion_ci(method="wilson")
    assert (result.low, result.high) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert result.estimate == count / total


@pytest.mark.parametrize("size", [6, 20, 500])
def test_95_percent_of_intervals_contain_mean(size):
    rng = random.Random(1)
    count = 0
    for _ in range(200):
        result = mean_interval([rng.gauss(5, 2) for _ in range(size)])
        count += result.low <= 5 <= result.high
    assert 178 <= count <= 199  # 190 of 200 are expected


@pytest.mark.parametrize(("size", "differs"), [(2, False), (5, False), (6, True), (11, True), (200, True)])
def test_equal_differences_exclude_zero_from_six_samples(size, differs):
    result = mean_interval([1.0] * size)
    assert (result.estimate, result.excludes_zero) == (1.0, differs)
    assert (result.as_dict()["low"] is None) is not differs
