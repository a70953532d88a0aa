"""Distributions of durations, and drawn durations in paths."""

from __future__ import annotations

import random
from statistics import median

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import VirtualClock
from cxbridge_explore.worldmodel.distributions import Distribution, Shape
from cxbridge_explore.worlds.points import (
    USUAL,
    Choice,
    ChoiceKind,
    Chooser,
    DivergedError,
    PathChooser,
    RandomChooser,
    RunChoices,
    Step,
    make_duration_option,
    read_path,
)

seconds = st.floats(0, 100)
distributions = st.builds(
    lambda shape, first, second, low, high: Distribution(
        shape, (min(first, second), max(first, second)), min(low, high), max(low, high)
    ),
    st.sampled_from([Shape.UNIFORM, Shape.NORMAL, Shape.CHOICE]),
    *[st.floats(0, 10)] * 2,
    *[seconds] * 2,
)


@given(distributions, st.integers())
def test_drawn_value_is_within_bounds(distribution, seed):
    drawn = distribution.draw(random.Random(seed))
    assert distribution.min_s - 0.001 <= drawn <= distribution.max_s + 0.001
    usual, *_ = values = distribution.representatives
    assert min(values) <= usual <= max(values)


@pytest.mark.parametrize(
    ("shape", "parameters", "expected"),
    [
        (Shape.UNIFORM, (2.0, 4.0), 3.0),
        (Shape.NORMAL, (5.0, 1.0), 5.0),
        (Shape.CHOICE, (1.0, 2.0, 9.0), 2.0),
    ],
)
def test_draws_have_median_of_distribution(shape, parameters, expected):
    distribution, rng = Distribution(shape, parameters), random.Random(7)
    assert distribution.representatives[0] == pytest.approx(expected, abs=0.001)
    assert median(distribution.draw(rng) for _ in range(4001)) == pytest.approx(expected, rel=0.1)


def choose_duration(chooser: Chooser) -> Choice:
    """Return the choice of a skill's duration by ``chooser``."""
    distribution = Distribution(Shape.UNIFORM, (2.0, 4.0))
    options = tuple(make_duration_option(each) for each in distribution.representatives)
    choices = RunChoices(chooser, VirtualClock())
    choices.choose(ChoiceKind.DURATION, "a: b{}", options, distribution)
    return choices.choices[0]


@given(st.integers())
def test_path_repeats_drawn_duration(seed):
    drawn = choose_duration(RandomChooser(seed))
    repeated = choose_duration(PathChooser(read_path([drawn.as_dict()])))
    assert repeated == drawn
    assert 2.0 <= drawn.taken_option.value <= 4.0


def test_path_accepts_only_options_of_choice_point():
    assert choose_duration(PathChooser({0: Step("a: b{}", "takes(4)")})).taken_option.value == 4.0
    with pytest.raises(DivergedError, match="no option 'fails'"):
        choose_duration(PathChooser({0: Step("a: b{}", "fails")}))
    assert choose_duration(PathChooser({})).option_index == USUAL
