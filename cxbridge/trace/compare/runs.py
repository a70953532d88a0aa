"""Compares recorded runs at a level and an order: the way in to this package."""

from __future__ import annotations

from collections.abc import Sequence

from cxbridge.errors import TraceError
from cxbridge.trace.compare.counts import compare_counts
from cxbridge.trace.compare.partial import compare_partial
from cxbridge.trace.compare.result import Comparison, Order
from cxbridge.trace.compare.streams import compare_streams
from cxbridge.trace.compare.total import compare_total
from cxbridge.trace.formats.base import Run
from cxbridge.trace.levels import View


def compare_runs(
    a: Run, others: Sequence[Run], view: View = View.TRANSITIONS, order: Order = Order.TOTAL
) -> Comparison:
    """Compare a run with others; it is the same when it is the same as each of them.

    :param others: at least one.
    :raises TraceError: when a run cannot be read, or was not recorded at this level.
    """
    if not others:
        raise ValueError("nothing to compare with")
    if view is View.TRANSITIONS and order is Order.PARTIAL:
        comparison = compare_partial(a, others)
        _need_events(a, comparison.count_a, view)
        _need_events(others[comparison.other], comparison.count_b, view)
        return comparison
    for number, other in enumerate(others):
        comparison = _compare(a, other, view, order)
        comparison.other = number
        _need_events(a, comparison.count_a, view)
        _need_events(other, comparison.count_b, view)
        if not comparison.same:
            break
    return comparison


def _compare(a: Run, b: Run, view: View, order: Order) -> Comparison:
    """Compare two runs."""
    if order is Order.TOTAL:
        return compare_total(a, b, view)
    if view in (View.SKILLS, View.BLACKBOARD):
        return compare_streams(a, b, view)
    return compare_counts(a, b, view)


def _need_events(run: Run, count: int, view: View) -> None:
    """Refuse a run that holds nothing of the view: two such runs are not the same, they are unknown."""
    if not count:
        raise TraceError(
            f"holds no events of level {view.value}",
            file=run.path,
            hint="record at this level, or compare at another one",
        )
