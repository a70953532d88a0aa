"""Statistics of samples: quantiles and confidence intervals."""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

CONFIDENCE: Final = 0.95
_SUBSETS: Final = 1999  # number of sampled subsets: of 2000, one more than this, 2.5 % is a whole number
_ROUNDING: Final = 1e-9  # 2000 * (1 - 0.95) / 2 is slightly less than 50 in floating point
_FEW: Final = 200  # with fewer values, the normal approximation of the mean is too coarse


@dataclass(frozen=True, slots=True)
class Quantiles:
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
        if not values:
            return None
        ordered = sorted(values)
        p05, p25, median, p75, p95 = (_quantile(ordered, share) for share in (0.05, 0.25, 0.5, 0.75, 0.95))
        mean = math.fsum(ordered) / len(ordered)
        return cls(ordered[0], p05, p25, median, p75, p95, ordered[-1], mean)

    def as_dict(self) -> dict[str, float]:
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
    """Return a quantile of sorted values, interpolated linearly (Hyndman and Fan's type 7)."""
    position = share * (len(ordered) - 1)
    low = math.floor(position)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (ordered[high] - ordered[low]) * (position - low)


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its confidence interval for :data:`CONFIDENCE`.

    The bounds are infinite if the sample is too small.
    """

    estimate: float
    low: float
    high: float

    def as_dict(self) -> dict[str, float | None]:
        """Return the interval as JSON values; an infinite bound becomes None."""
        low, high = (round(bound, 6) if math.isfinite(bound) else None for bound in (self.low, self.high))
        return {"estimate": round(self.estimate, 6), "low": low, "high": high}

    def span(self, form: str, *, scale: float = 1.0, unit: str = "") -> str:
        """Return the bounds as text, such as ``+2.0 to +13.0``.

        :param form: the format of a bound for :func:`format`.
        """
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            return "too few for an interval"
        return f"{self.low * scale:{form}} to {self.high * scale:{form}}{unit}"

    @property
    def excludes_zero(self) -> bool:
        """Whether the difference is significant: zero is outside of the interval."""
        return self.low > 0 or self.high < 0


def proportion(count: int, total: int) -> Interval:
    """Return the share of successes with Wilson's score interval.

    :param total: at least 1.
    """
    z = _z()
    share = count / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total)) / (1 + z * z / total)
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))


def mean_interval(values: Sequence[float]) -> Interval:
    """Return the mean of a sample with its confidence interval.

    Large samples use the normal distribution. For small samples, the centre of a symmetric distribution is
    equally probable between any two neighbouring means of subsets (Hartigan 1969): the interval excludes zero
    exactly if the permutation test of signs does. Five values or fewer have no interval, even if they are
    equal.

    :param values: at least one.
    """
    mean = math.fsum(values) / len(values)
    if len(values) > _FEW:
        half = _z() * statistics.stdev(values) / math.sqrt(len(values))
        return Interval(mean, mean - half, mean + half)
    means = sorted(_subset_means(values))
    outside = math.floor((len(means) + 1) * (1 - CONFIDENCE) / 2 + _ROUNDING)
    if outside < 1:
        return Interval(mean, -math.inf, math.inf)
    return Interval(mean, means[outside - 1], means[-outside])


def _subset_means(values: Sequence[float]) -> Iterator[float]:
    masks: Iterable[int] = range(1, 2 ** len(values))
    if 2 ** len(values) > _SUBSETS:
        rng = random.Random(0)  # noqa: S311 - the same values give the same interval
        masks = (rng.randrange(1, 2 ** len(values)) for _ in range(_SUBSETS))
    for mask in masks:
        chosen = [value for index, value in enumerate(values) if mask >> index & 1]
        yield math.fsum(chosen) / len(chosen)


def _z() -> float:
    return statistics.NormalDist().inv_cdf(1 - (1 - CONFIDENCE) / 2)
