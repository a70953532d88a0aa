"""Distributions of seconds: what durations are drawn from, and which of them stand for all."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from enum import StrEnum
from statistics import NormalDist
from typing import Final, assert_never

DIGITS: Final = 3
"""Drawn seconds are rounded to milliseconds, so that a path can carry them as text."""

_TAIL: Final = 0.05


class Shape(StrEnum):
    """The kinds of distributions, with their parameters."""

    CONSTANT = "constant"  # value
    UNIFORM = "uniform"  # least, greatest
    NORMAL = "normal"  # mean, standard deviation
    LOGNORMAL = "lognormal"  # median, standard deviation of the logarithm
    EXPONENTIAL = "exponential"  # mean
    CHOICE = "choice"  # values, each as likely as another


PARAMETERS: Final = {
    Shape.CONSTANT: ("seconds",),
    Shape.UNIFORM: ("least", "greatest"),
    Shape.NORMAL: ("mean", "standard deviation"),
    Shape.LOGNORMAL: ("median", "standard deviation of the logarithm"),
    Shape.EXPONENTIAL: ("mean",),
}
"""The names of the parameters of each shape but a choice, which has any number."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of seconds.

    :param parameters: those of :class:`Shape`.
    :param least: lower values become this one.
    :param most: higher values become this one.
    :param listed: seconds that represent the distribution in an exploration, the usual one first; empty:
        median, minimum and maximum.
    """

    shape: Shape
    parameters: tuple[float, ...]
    least: float = 0.0
    most: float = math.inf
    listed: tuple[float, ...] = ()

    @classmethod
    def constant(cls, seconds: float) -> Distribution:
        """Return the constant distribution of this many seconds."""
        return cls(Shape.CONSTANT, (seconds,))

    def quantile(self, share: float) -> float:
        """Return the seconds that a share of all does not exceed.

        :param share: from 0 to 1; without the ends where there is no least or greatest.
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
        """Draw seconds, with one number of the generator."""
        share = rng.random()
        while not share:
            share = rng.random()
        return self.quantile(share)

    @property
    def median(self) -> float:
        """The usual seconds: the first that is listed, else the median."""
        return self.listed[0] if self.listed else self.quantile(0.5)

    @property
    def least_usual(self) -> float:
        """The minimum; of a distribution with tails, the 5 % quantile."""
        return self.quantile(0.0 if self._is_bounded else _TAIL)

    @property
    def most_usual(self) -> float:
        """The maximum; of a distribution with tails, the 95 % quantile."""
        return self.quantile(1.0 if self._is_bounded else 1 - _TAIL)

    @property
    def _is_bounded(self) -> bool:
        return self.shape in (Shape.CONSTANT, Shape.UNIFORM, Shape.CHOICE)

    @property
    def representatives(self) -> tuple[float, ...]:
        """The seconds that stand for all of it in an exploration, the usual one first."""
        found = self.listed or (self.median, self.least_usual, self.most_usual)
        return tuple(dict.fromkeys(found))


def text_of(seconds: float) -> str:
    """Return seconds as a path has them."""
    return f"{seconds:.{DIGITS}f}".rstrip("0").rstrip(".")
