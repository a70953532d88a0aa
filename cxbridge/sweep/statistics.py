"""What samples say about what they are drawn from: quantiles, and intervals of confidence."""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

CONFIDENCE: Final = 0.95
_RESAMPLES: Final = 2000
_FEW: Final = 200
"""With fewer values the mean is not distributed normally enough; then they are resampled."""


@dataclass(frozen=True, slots=True)
class Quantiles:
    """How values are distributed."""

    minimum: float
    p05: float
    p25: float
    median: float
    p75: float
    p95: float
    maximum: float
    mean: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Quantiles | None:
        """Return those of values; None of none."""
        if not values:
            return None
        ordered = sorted(values)
        p05, p25, median, p75, p95 = (_quantile(ordered, share) for share in (0.05, 0.25, 0.5, 0.75, 0.95))
        mean = math.fsum(ordered) / len(ordered)
        return cls(ordered[0], p05, p25, median, p75, p95, ordered[-1], mean)

    def as_dict(self) -> dict[str, float]:
        """Return them as JSON can have them."""
        return {
            "min": round(self.minimum, 6),
            "p05": round(self.p05, 6),
            "p25": round(self.p25, 6),
            "median": round(self.median, 6),
            "p75": round(self.p75, 6),
            "p95": round(self.p95, 6),
            "max": round(self.maximum, 6),
            "mean": round(self.mean, 6),
        }


def _quantile(ordered: Sequence[float], share: float) -> float:
    """Return a quantile of ordered values, linear between two neighbours (Hyndman and Fan's type 7)."""
    place = share * (len(ordered) - 1)
    low = math.floor(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (ordered[high] - ordered[low]) * (place - low)


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate, and between what the true value is with :data:`CONFIDENCE`."""

    estimate: float
    low: float
    high: float

    def as_dict(self) -> dict[str, float]:
        """Return it as JSON can have it."""
        return {"estimate": round(self.estimate, 6), "low": round(self.low, 6), "high": round(self.high, 6)}

    @property
    def excludes_zero(self) -> bool:
        """Whether there is a difference: zero is not in the interval."""
        return self.low > 0 or self.high < 0


def proportion(count: int, total: int) -> Interval:
    """Return the share of successes among trials, with Wilson's score interval.

    :param total: above 0.
    """
    z = _z()
    share = count / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total)) / (1 + z * z / total)
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))


def mean_interval(values: Sequence[float]) -> Interval:
    """Return the mean of what values are drawn from: by resampling when they are few, else as normal.

    :param values: at least one.
    """
    mean = math.fsum(values) / len(values)
    if len(values) == 1:
        return Interval(mean, -math.inf, math.inf)
    if len(values) > _FEW:
        half = _z() * statistics.stdev(values) / math.sqrt(len(values))
        return Interval(mean, mean - half, mean + half)
    rng = random.Random(0)  # noqa: S311 - the same values give the same interval
    means = sorted(math.fsum(rng.choices(values, k=len(values))) / len(values) for _ in range(_RESAMPLES))
    tail = (1 - CONFIDENCE) / 2
    return Interval(mean, _quantile(means, tail), _quantile(means, 1 - tail))


def _z() -> float:
    return statistics.NormalDist().inv_cdf(1 - (1 - CONFIDENCE) / 2)
