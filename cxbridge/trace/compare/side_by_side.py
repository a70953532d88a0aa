"""A comparison as JSON values for an HTML page: goals side by side, and the contexts of differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any, Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.event_kinds import View
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.forest import Forest
from cxbridge.history.model import GoalRecord
from cxbridge.history.outcome import goal_outcome
from cxbridge.trace.compare.context import read_contexts
from cxbridge.trace.compare.goal_matching import GoalMatch
from cxbridge.trace.compare.goals import GoalForest
from cxbridge.trace.compare.render.json import report_to_json
from cxbridge.trace.compare.render.text import ComparisonReport
from cxbridge.trace.compare.selection import Selection
from cxbridge.trace.compare.steps import StepReader
from cxbridge.trace.formats.base import Run

# Both limits are chosen freely; they keep the page of a long run small.
MAX_EXPLAINED_DIFFERENCES: Final = 30
"""The maximum number of differences with a context."""

MAX_ROWS: Final = 500
"""The maximum number of displayed rows of goals."""

Bar: TypeAlias = dict[str, Any]
"""A goal on the page: its name, class, begin, end, outcome and error.

Begin and end are in seconds since the start of the run; if one of the runs has no times, they are numbers of
events in both runs.
"""


def page_report(
    report: ComparisonReport,
    options: Mapping[str, Any] | None = None,
    selection: Selection | None = None,
) -> dict[str, Any]:
    """Return the values of :func:`.render.json.report_to_json`, and values that only a page shows.

    :param options: the options of the comparison.
    :param selection: the selection with which the runs were compared.
    :returns: the further values are ``contexts``, the contexts of the first differences in their order, by
        side; ``goals``, rows with ``label``, ``depth`` and the bars of both sides; ``more_goals``, the number
        of omitted rows; ``end``, the length of each side; ``start_us``, the start of each side, 0 if it is
        unknown; and ``unit``, which is ``s``, or ``steps`` if a run has no times.
    """
    explained_differences = report.comparison.differences[:MAX_EXPLAINED_DIFFERENCES]
    contexts: list[list[dict[str, Any]]] = []
    for run, sides in (
        (report.a, [difference.a for difference in explained_differences]),
        (report.b, [difference.b for difference in explained_differences]),
    ):
        positions = [side.position for side in sides]
        contexts_by_position = read_contexts(run, report.comparison.view, positions, selection)
        contexts.append([asdict(contexts_by_position[position]) for position in positions])
    return {
        **report_to_json(report, options),
        "contexts": [{"a": a, "b": b} for a, b in zip(*contexts, strict=True)],
        **_compare_goals(report.a, report.b),
    }


def _compare_goals(a: Run, b: Run) -> dict[str, Any]:
    """Return the rows of goals in the order of their trees, with lengths, starts and unit."""
    histories = [RunHistory.from_events(run, UNLIMITED, run.start_us) for run in (a, b)]
    # a text of transitions may have no times: the numbers of events then replace them
    has_times = all(history.end > 0 for history in histories)
    bars = [_make_bars(history, has_times=has_times) for history in histories]
    ends = [history.end / MICROSECONDS if has_times else history.event_count for history in histories]
    match = GoalMatch(*(GoalForest(StepReader().read(run, View.TRANSITIONS)) for run in (a, b)))
    rows: dict[str, dict[str, Any]] = {}
    for goal_a, goal_b in match.pairs:
        rows[match.labels[goal_a]] = {"a": bars[0].get(goal_a.key), "b": bars[1].get(goal_b.key)}
    for side, unmatched_goals in zip("ab", match.unmatched_goals, strict=True):
        for goal in unmatched_goals:
            rows[match.labels[goal]] = {"a": None, "b": None, side: bars["ab".index(side)].get(goal.key)}
    sorted_rows = list(_sort_rows(rows))
    return {
        "unit": "s" if has_times else "steps",
        "end": dict(zip("ab", ends, strict=True)),
        "start_us": {
            side: history.clock.start_us or 0 for side, history in zip("ab", histories, strict=True)
        },
        "goals": sorted_rows[:MAX_ROWS],
        "more_goals": max(0, len(sorted_rows) - MAX_ROWS),
    }


def _make_bars(history: RunHistory, *, has_times: bool) -> dict[tuple[str, str], Bar]:
    """Return the first life of each goal as a bar."""
    bars: dict[tuple[str, str], Bar] = {}
    for goal in history.goals:
        # the comparison identifies goals by their ids: all lives of an id are one row, whose bar is the first
        # life
        bars.setdefault((goal.env, goal.id), _make_bar(goal, history, has_times=has_times))
    return bars


def _make_bar(goal: GoalRecord, history: RunHistory, *, has_times: bool) -> Bar:
    """Return the bar of a goal; a goal without an outcome lasts until the end of the run."""
    first_change, end_change = goal.changes[0], goal.end_change
    if has_times:
        begin = first_change.time / MICROSECONDS
        end = (history.end if end_change is None else end_change.time) / MICROSECONDS
    else:
        begin, end = first_change.seq, (history.event_count if end_change is None else end_change.seq)
    return {
        "goal": goal.name,
        "goal_class": goal.goal_class,
        "begin": begin,
        "end": end,
        "outcome": goal_outcome(goal.mode, goal.outcome).name.lower(),
        "error": goal.error,
    }


def _sort_rows(rows: Mapping[str, dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield the rows of parents before those of their children, siblings by start."""

    def earliest_begin(label: str) -> float:
        return min((bar["begin"] for bar in rows[label].values() if bar is not None), default=0)

    forest = Forest({label: label.rpartition("/")[0] for label in sorted(rows, key=earliest_begin)})
    for label, depth in forest.walk():
        yield {"label": label.rpartition("/")[2], "depth": depth, **rows[label]}
