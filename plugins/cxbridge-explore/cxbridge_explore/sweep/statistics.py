"""Statistics of samples: quantiles and confidence intervals."""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

CONFIDENCE: Final = 0.95
_NORMAL_QUANTILE: Final = statistics.NormalDist().inv_cdf(1 - (1 - CONFIDENCE) / 2)  # 1.96
# Limit of the number of subsets: their means bound 2000 ranges, of which 2.5 % is a whole number.
_MAX_SUBSETS: Final = 1999
# The normal approximation of the mean is too coarse for samples up to this size.
_MAX_SMALL_SAMPLE: Final = 200

_QUANTILES: Final = {"p05": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95}


def summarize_sample(values: Sequence[float]) -> dict[str, float] | None:
    """Return the minimum, quantiles, the maximum and the mean of a sample by name; None without values."""
    if not values:
        return None
    sorted_values = sorted(values)
    summary = {
        "min": sorted_values[0],
        **{name: _interpolate_quantile(sorted_values, share) for name, share in _QUANTILES.items()},
        "max": sorted_values[-1],
        "mean": math.fsum(sorted_values) / len(sorted_values),
    }
    return {name: round(value, 6) for name, value in summary.items()}


def _interpolate_quantile(sorted_values: Sequence[float], share: float) -> float:
    """Return a quantile of sorted values by linear interpolation (type 7 of Hyndman and Fan 1996)."""
    position = share * (len(sorted_values) - 1)
    index = math.floor(position)
    lower_value, upper_value = sorted_values[index], sorted_values[min(index + 1, len(sorted_values) - 1)]
    return lower_value + (upper_value - lower_value) * (position - index)


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

    def format_bounds(self, number_format: str, *, scale: float = 1.0) -> str:
        """Return the bounds as text, such as ``+2.0 to +13.0``.

        :param number_format: the format of a bound for :func:`format`.
        :param scale: the factor of the bounds.
        """
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            return "too few for an interval"
        return f"{self.low * scale:{number_format}} to {self.high * scale:{number_format}}"

    @property
    def excludes_zero(self) -> bool:
        """Whether zero is outside of the interval, so that a difference is significant."""
        return self.low > 0 or self.high < 0


def proportion_interval(count: int, total: int) -> Interval:
    """Return the share of successes in a sample, with Wilson's score interval.

    :param count: the number of successes.
    :param total: the size of the sample; at least 1.
    """
    z = _NORMAL_QUANTILE
    share = count / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half_width = (
        z * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total)) / (1 + z * z / total)
    )
    return Interval(share, max(0.0, middle - half_width), min(1.0, middle + half_width))


def mean_interval(values: Sequence[float]) -> Interval:
    """Return the mean of a sample with its confidence interval.

    Large samples use the normal distribution. For small samples, the centre of a symmetric distribution is
    equally probable between any two neighbouring means of subsets (Hartigan 1969). With all subsets, the
    interval excludes zero exactly if the permutation test of signs does; random subsets approximate this.
    Five values or fewer have no interval, even if they are equal.

    :param values: the sample; at least one value.
    """
    mean = math.fsum(values) / len(values)
    if len(values) > _MAX_SMALL_SAMPLE:
        half_width = _NORMAL_QUANTILE * statistics.stdev(values) / math.sqrt(len(values))
        return Interval(mean, mean - half_width, mean + half_width)
    means = sorted(_compute_subset_means(values))
    # The means bound len(means) + 1 equally probable ranges; this many are left out at each end.
    excluded_count = math.floor((len(means) + 1) * (1 - CONFIDENCE) / 2)
    if excluded_count < 1:
        return Interval(mean, -math.inf, math.inf)
    return Interval(mean, means[excluded_count - 1], means[-excluded_count])


def _compute_subset_means(values: Sequence[float]) -> Iterator[float]:
    """Yield the means of all subsets except the empty one, or of :data:`_MAX_SUBSETS` random ones.

    A subset is a bit mask: bit ``n`` selects the value ``n``.
    """
    masks: Iterable[int] = range(1, 2 ** len(values))
    if 2 ** len(values) > _MAX_SUBSETS:
        rng = random.Random(0)  # noqa: S311 - the same values give the same interval
        masks = (rng.randrange(1, 2 ** len(values)) for _ in range(_MAX_SUBSETS))
    for mask in masks:
        chosen_values = [value for index, value in enumerate(values) if mask >> index & 1]
        yield math.fsum(chosen_values) / len(chosen_values)
