"""Timing in pairs in one process, with medians, because machines are noisy."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

ROUNDS = 15  # chosen freely


def batch_seconds(work: Callable[[], object], batch: int) -> float:
    """Return the seconds of ``batch`` calls of ``work``."""
    started = time.perf_counter()
    for _ in range(batch):
        work()
    return time.perf_counter() - started


def paired_ratio(work: Callable[[], object], rival: Callable[[], object], batch: int) -> float:
    """Return the median ratio of the times of ``work`` and ``rival``, which are timed in turn.

    Prints the median times of a call.
    """
    # the first calls fill caches
    batch_seconds(work, batch)
    batch_seconds(rival, batch)
    pairs = [(batch_seconds(work, batch), batch_seconds(rival, batch)) for _ in range(ROUNDS)]
    ours_s = statistics.median(first for first, _ in pairs) / batch
    rival_s = statistics.median(second for _, second in pairs) / batch
    print(f"  {ours_s * 1e6:.2f} us against {rival_s * 1e6:.2f} us a call (medians of {ROUNDS})")
    return statistics.median(first / second for first, second in pairs)


def report(name: str, figure: float, limit: float) -> None:
    """Print a figure, such as a ratio, and whether it is at most its limit."""
    print(f"{name}: {figure:.2f} (limit {limit:g}) {'ok' if figure <= limit else 'TOO SLOW'}")
