"""Distributions of durations, and the values that represent them in an exploration."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from enum import StrEnum
from statistics import NormalDist
from typing import Final, assert_never

# Seconds are rounded to milliseconds, so that the text of a choice in a path stands for the same number.
MAX_DECIMALS: Final = 3

# In an exploration, the 5 % and the 95 % quantiles replace the missing bounds of a normal distribution.
_TAIL_SHARE: Final = 0.05


class Shape(StrEnum):
    """The kinds of distributions; see :data:`PARAMETER_NAMES`."""

    CONSTANT = "constant"
    UNIFORM = "uniform"
    NORMAL = "normal"
    CHOICE = "choice"


# The names of the parameters by shape. The parameters of a choice are any number of equally likely values.
PARAMETER_NAMES: Final = {
    Shape.CONSTANT: ("seconds",),
    Shape.UNIFORM: ("least", "greatest"),
    Shape.NORMAL: ("mean", "standard deviation"),
}


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of seconds.

    :param parameters: the parameters of the shape.
    :param min_s: the lower bound; smaller values become the bound.
    :param max_s: the upper bound; larger values become the bound.
    """

    shape: Shape
    parameters: tuple[float, ...]
    min_s: float = 0.0
    max_s: float = math.inf

    @classmethod
    def constant(cls, seconds: float) -> Distribution:
        return cls(Shape.CONSTANT, (seconds,))

    def quantile(self, share: float) -> float:
        """Return a quantile.

        :param share: the share of smaller values, from 0 to 1. A normal distribution has no quantiles of 0
            and 1.
        """
        return round(min(max(self._unbounded_quantile(share), self.min_s), self.max_s), MAX_DECIMALS)

    def _unbounded_quantile(self, share: float) -> float:
        first, last = self.parameters[0], self.parameters[-1]
        match self.shape:
            case Shape.CONSTANT:
                return first
            case Shape.UNIFORM:
                return first + share * (last - first)
            case Shape.NORMAL:
                # `NormalDist` has no quantiles for a standard deviation of 0
                return NormalDist(first, last).inv_cdf(share) if last else first
            case Shape.CHOICE:
                values = sorted(self.parameters)
                return values[min(int(share * len(values)), len(values) - 1)]
        assert_never(self.shape)

    def draw(self, rng: random.Random) -> float:
        """Draw a value, by the quantile of a random share."""
        share = rng.random()
        while not share:  # a normal distribution has no quantile of 0
            share = rng.random()
        return self.quantile(share)

    @property
    def representatives(self) -> tuple[float, ...]:
        """The values that represent the distribution in an exploration: the median, the minimum, the maximum.

        For a normal distribution, the 5 % and 95 % quantiles replace the minimum and the maximum.
        """
        tail = _TAIL_SHARE if self.shape is Shape.NORMAL else 0.0
        return tuple(dict.fromkeys(map(self.quantile, (0.5, tail, 1 - tail))))


def format_seconds(seconds: float) -> str:
    """Return seconds as text without trailing zeros."""
    return f"{seconds:.{MAX_DECIMALS}f}".rstrip("0").rstrip(".")
