"""The entry point of comparisons: runs, level and order."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event
from cxbridge.trace.compare.goal_matching import GoalMatch
from cxbridge.trace.compare.goals import GoalForest
from cxbridge.trace.compare.model import Comparison, Difference, Order, Side, sort_differences
from cxbridge.trace.compare.partial import compare_counts, compare_goals, find_broken_relations
from cxbridge.trace.compare.selection import Selection, compared_contents
from cxbridge.trace.compare.steps import Step, StepReader, describe_subject, find_missing_details
from cxbridge.trace.compare.total import compare_total
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe_details, describe_event

COUNTED_VIEWS = (View.RULES, View.FACTS)
"""The levels at which partial order counts events: without goals, the dependencies are unknown."""


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
    :raises TraceError: if a run cannot be read, was not recorded at this level or has no compared event, or
        if times cannot be compared at this level and in this order.
    """
    is_counted = order is Order.PARTIAL and view in COUNTED_VIEWS
    if tolerance_s is not None and is_counted:
        raise TraceError(
            f"in partial order, {view.value} have no times that could be compared",
            hint="use --order total with --time-tolerance",
        )
    missing_details = find_missing_details([a, *others]) if view is View.TRANSITIONS else {}
    shared: dict[Any, Any] = {}  # one object for each key, see StepReader
    counts: list[int] = []  # of the compared events, by run

    def read(run: Run) -> Iterator[tuple[Step, Event]]:
        reader = StepReader(missing_details, shared)
        yield from reader.read(run, view, selection)
        counts.append(reader.count)
        if not reader.count:  # two empty runs prove nothing
            raise TraceError(
                f"the run has no events of level {view.value}",
                file=run.path,
                hint="record at this level or compare at another level, and check that --only selects events",
            )

    differences: list[Difference] = []
    matches: list[GoalMatch] = []
    # partial order compares goals, unless it counts events; all else compares steps
    has_goals = order is Order.PARTIAL and not is_counted
    forest_a, steps_a = (GoalForest(read(a)), []) if has_goals else (None, [step for step, _ in read(a)])
    other_index = -1
    for other in others:
        other_index += 1
        if forest_a is not None:
            matches.append(GoalMatch(forest_a, GoalForest(read(other))))
            differences = sort_differences(compare_goals(matches[-1], tolerance_s))
        else:
            steps_b = [step for step, _ in read(other)]
            if is_counted:
                differences = sort_differences(compare_counts(steps_a, steps_b))
            else:
                differences = [*compare_total(steps_a, steps_b, tolerance_s)]
        # the first run that differs is the result
        if differences:
            break
    # no single run differs in a relation, because all other runs agree: the report shows the first of them
    if matches and not differences:
        other_index, differences = 0, sort_differences(find_broken_relations(matches))
    _describe_events(differences, "a", compared_contents(a, view, selection))
    _describe_events(differences, "b", compared_contents(others[other_index], view, selection))
    return Comparison(view, order, counts[0], counts[other_index + 1], differences, other_index)


def _describe_events(differences: Sequence[Difference], side_name: str, events: Iterable[Event]) -> None:
    """Add the subjects and the texts of the events of one run to differences.

    :param side_name: ``a`` or ``b``.
    :param events: the compared events of the run.
    """
    incomplete: dict[int | None, list[tuple[Difference, Side]]] = defaultdict(list)
    for difference in differences:
        side: Side = getattr(difference, side_name)
        if not side.text:
            incomplete[side.position].append((difference, side))
    for position, event in enumerate(events):
        # all texts are complete, and the rest of the run may be long
        if not incomplete:
            break
        for difference, side in incomplete.pop(position, ()):
            details = f" {describe_details(event)}" if difference.has_details else ""
            side.text = f"{describe_event(event)}{details}"
            difference.subject = difference.subject or describe_subject(event)
