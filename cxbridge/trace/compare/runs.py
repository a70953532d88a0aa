"""The entry point of comparisons: runs, level and order."""

from __future__ import annotations

from collections.abc import Sequence

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.trace.compare.details import find_missing_details
from cxbridge.trace.compare.model import Comparison, Order
from cxbridge.trace.compare.partial import compare_counts, compare_partial
from cxbridge.trace.compare.selection import Selection, compared_contents
from cxbridge.trace.compare.sequences import compare_streams
from cxbridge.trace.compare.total import compare_total
from cxbridge.trace.formats.base import Run


def compare_runs(
    a: Run,
    others: Sequence[Run],
    view: View = View.TRANSITIONS,
    order: Order = Order.TOTAL,
    *,
    selection: Selection | None = None,
    tolerance_s: float | None = None,
) -> Comparison:
    """Compare a run with each of several runs; the run must equal all of these runs.

    :param others: at least one run to compare with.
    :param selection: the compared events; None: all.
    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    :raises TraceError: if a run cannot be read, or was not recorded at this level.
    """
    # in partial order, firings and changes of facts are counted, and a count has no time
    if tolerance_s is not None and order is Order.PARTIAL and view in {View.RULES, View.FACTS}:
        raise TraceError(
            f"in partial order, {view.value} have no times that could be compared",
            hint="use --order total with --time-tolerance",
        )
    missing_details = find_missing_details([a, *others]) if view is View.TRANSITIONS else {}
    if view is View.TRANSITIONS and order is Order.PARTIAL:
        events, *other_events = (compared_contents(run, view, selection) for run in (a, *others))
        comparison = compare_partial(events, other_events, tolerance_s, missing_details)
        _need_events(a, comparison.count_a, view)
        _need_events(others[comparison.other_index], comparison.count_b, view)
        return comparison
    for number, other in enumerate(others):
        if order is Order.TOTAL:
            comparison = compare_total(a, other, view, selection, tolerance_s, missing_details)
        else:
            pair = compared_contents(a, view, selection), compared_contents(other, view, selection)
            if view in {View.SKILLS, View.BLACKBOARD}:
                comparison = compare_streams(*pair, view, tolerance_s)
            else:
                comparison = compare_counts(*pair, view)
        comparison.other_index = number
        _need_events(a, comparison.count_a, view)
        _need_events(other, comparison.count_b, view)
        # the first run that differs is the result
        if not comparison.same:
            break
    return comparison


def _need_events(run: Run, count: int, view: View) -> None:
    """Check that a run has events of the level, because two empty runs prove nothing."""
    if not count:
        raise TraceError(
            f"the run has no events of level {view.value}",
            file=run.path,
            hint="record at this level or compare at another level, and check that --only selects events",
        )
