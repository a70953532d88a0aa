"""Quantiles and intervals, held against numpy, scipy and simulation."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge_explore.sweep.statistics import mean_interval, proportion_interval, summarize_sample

VALUES = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60)


@given(VALUES)
def test_quantiles_are_those_of_numpy(values):
    numpy = pytest.importorskip("numpy")
    found = summarize_sample(values)
    assert found is not None
    shares = {"min": 0, "p05": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95, "max": 1}
    theirs = {name: numpy.quantile(values, share) for name, share in shares.items()}
    assert found == pytest.approx(theirs | {"mean": numpy.mean(values)}, abs=1e-6)


@given(st.integers(1, 400).flatmap(lambda total: st.tuples(st.integers(0, total), st.just(total))))
def test_a_proportions_interval_is_that_of_wilson(counts):
    stats = pytest.importorskip("scipy.stats")
    count, total = counts
    found = proportion_interval(count, total)
    theirs = stats.binomtest(count, total).proportion_ci(method="wilson")
    assert (found.low, found.high) == pytest.approx((theirs.low, theirs.high), abs=1e-9)
    assert found.estimate == count / total


@pytest.mark.parametrize("size", [6, 20, 500])
def test_nineteen_of_twenty_intervals_hold_the_mean(size):
    rng = random.Random(1)
    held = 0
    for _ in range(200):
        found = mean_interval([rng.gauss(5, 2) for _ in range(size)])
        held += found.low <= 5 <= found.high
    assert 178 <= held <= 199  # of 200; 190 are expected


@pytest.mark.parametrize(("size", "differs"), [(2, False), (5, False), (6, True), (11, True), (200, True)])
def test_equal_differences_prove_something_when_they_are_enough(size, differs):
    found = mean_interval([1.0] * size)
    assert (found.estimate, found.excludes_zero) == (1.0, differs)
    assert (found.as_dict()["low"] is None) is not differs
