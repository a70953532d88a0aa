"""Distributions of durations, and the values that represent them in an exploration."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from enum import StrEnum
from statistics import NormalDist
from typing import Final, assert_never

# Drawn seconds are rounded to milliseconds, so that a path can contain them as text.
DIGITS: Final = 3

_TAIL: Final = 0.05  # an unbounded distribution has no minimum; the 5 % quantile stands in for it


class Shape(StrEnum):
    """The kinds of distributions; comments list their parameters."""

    CONSTANT = "constant"  # value
    UNIFORM = "uniform"  # least, greatest
    NORMAL = "normal"  # mean, standard deviation
    LOGNORMAL = "lognormal"  # median, standard deviation of the logarithm
    EXPONENTIAL = "exponential"  # mean
    CHOICE = "choice"  # equally likely values


# Names of the parameters by shape; a choice has any number.
PARAMETERS: Final = {
    Shape.CONSTANT: ("seconds",),
    Shape.UNIFORM: ("least", "greatest"),
    Shape.NORMAL: ("mean", "standard deviation"),
    Shape.LOGNORMAL: ("median", "standard deviation of the logarithm"),
    Shape.EXPONENTIAL: ("mean",),
}


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of seconds.

    :param parameters: the parameters of the shape.
    :param least: the lower bound; smaller values are raised to the bound.
    :param most: the upper bound; larger values are lowered to the bound.
    :param listed: the values that represent the distribution in an exploration, the usual value first; empty
        for the median, the minimum and the maximum.
    """

    shape: Shape
    parameters: tuple[float, ...]
    least: float = 0.0
    most: float = math.inf
    listed: tuple[float, ...] = ()

    @classmethod
    def constant(cls, seconds: float) -> Distribution:
        return cls(Shape.CONSTANT, (seconds,))

    def quantile(self, share: float) -> float:
        """Return a quantile.

        :param share: the share of smaller values, from 0 to 1; for an unbounded distribution without 0 and 1.
        """
        return round(min(max(self._unbounded(share), self.least), self.most), DIGITS)

    def _unbounded(self, share: float) -> float:
        first, last = self.parameters[0], self.parameters[-1]
        match self.shape:
            case Shape.CONSTANT:
                return first
            case Shape.UNIFORM:
                return first + share * (last - first)
            case Shape.NORMAL:
                return NormalDist(first, last).inv_cdf(share) if last else first
            case Shape.LOGNORMAL:
                return first * math.exp(NormalDist(0.0, last).inv_cdf(share)) if last else first
            case Shape.EXPONENTIAL:
                return -first * math.log1p(-share)
            case Shape.CHOICE:
                values = sorted(self.parameters)
                return values[min(int(share * len(values)), len(values) - 1)]
        assert_never(self.shape)

    def draw(self, rng: random.Random) -> float:
        """Draw a value, with one number of the generator."""
        share = rng.random()
        while not share:  # the quantile 0 of an unbounded distribution is infinite
            share = rng.random()
        return self.quantile(share)

    @property
    def median(self) -> float:
        """The usual value: the first listed value, else the median."""
        return self.listed[0] if self.listed else self.quantile(0.5)

    @property
    def low_quantile(self) -> float:
        """The minimum, or the 5 % quantile of a distribution with tails."""
        return self.quantile(0.0 if self._is_bounded else _TAIL)

    @property
    def high_quantile(self) -> float:
        """The maximum, or the 95 % quantile of a distribution with tails."""
        return self.quantile(1.0 if self._is_bounded else 1 - _TAIL)

    @property
    def _is_bounded(self) -> bool:
        return self.shape in (Shape.CONSTANT, Shape.UNIFORM, Shape.CHOICE)

    @property
    def representatives(self) -> tuple[float, ...]:
        """The values that represent the distribution in an exploration, the usual value first."""
        values = self.listed or (self.median, self.low_quantile, self.high_quantile)
        return tuple(dict.fromkeys(values))


def text_of(seconds: float) -> str:
    """Return seconds as text without trailing zeros."""
    return f"{seconds:.{DIGITS}f}".rstrip("0").rstrip(".")
