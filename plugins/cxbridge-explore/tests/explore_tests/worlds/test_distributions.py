"""Durations are drawn within their bounds, and a drawn one can be followed again."""

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
    lambda shape, one, other, low, high: Distribution(
        shape, (min(one, other), max(one, other)), min(low, high), max(low, high)
    ),
    st.sampled_from([Shape.UNIFORM, Shape.NORMAL, Shape.CHOICE]),
    *[st.floats(0, 10)] * 2,
    *[seconds] * 2,
)


@given(distributions, st.integers())
def test_what_is_drawn_is_within_the_bounds(distribution, seed):
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
def test_the_draws_have_the_median_of_their_distribution(shape, parameters, expected):
    distribution, rng = Distribution(shape, parameters), random.Random(7)
    assert distribution.representatives[0] == pytest.approx(expected, abs=0.001)
    assert median(distribution.draw(rng) for _ in range(4001)) == pytest.approx(expected, rel=0.1)


def duration(chooser: Chooser) -> Choice:
    """Let a chooser decide the duration of a skill."""
    distribution = Distribution(Shape.UNIFORM, (2.0, 4.0))
    options = tuple(make_duration_option(each) for each in distribution.representatives)
    choices = RunChoices(chooser, VirtualClock())
    choices.choose(ChoiceKind.DURATION, "a: b{}", options, distribution)
    return choices.choices[0]


@given(st.integers())
def test_a_drawn_duration_is_in_the_path_and_can_be_followed(seed):
    drawn = duration(RandomChooser(seed))
    followed = duration(PathChooser(read_path([drawn.as_dict()])))
    assert followed == drawn
    assert 2.0 <= drawn.taken_option.value <= 4.0


def test_a_path_may_name_what_is_listed_but_nothing_else():
    assert duration(PathChooser({0: Step("a: b{}", "takes(4)")})).taken_option.value == 4.0
    with pytest.raises(DivergedError, match="no option 'fails'"):
        duration(PathChooser({0: Step("a: b{}", "fails")}))
    assert duration(PathChooser({})).option_index == USUAL
