"""The verdict of a replay: whether the run decided the same as the recorded one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, SkillStatus
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.replay.divergence import Divergence
from cxbridge.run.replay.scan import Scan
from cxbridge.run.result import ReplayOutcome
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.model import Comparison, Order
from cxbridge.trace.compare.render.json import plain_report
from cxbridge.trace.compare.render.text import make_report, text_report
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run


def judge(
    ours: Path,
    decisions: Scan,
    order: Order,
    divergence: Divergence | None,
    *,
    whole: bool,
    tolerance: Tolerance | None = None,
) -> ReplayOutcome:
    """Compare a run with the recorded one.

    :param ours: the recording of this run.
    :param whole: whether the recorded run had come to its end; else it is compared up to there.
    :param tolerance: how far times may be apart; None: times do not count.
    :raises TraceError: when there is nothing to compare.
    """
    compared = str(decisions.run.path)
    if divergence is not None:
        return ReplayOutcome(compared, order.value, divergence, same=False, whole=whole)
    view = View.TRANSITIONS if decisions.goals else View.SKILLS
    mine, theirs = open_run(ours), decisions.run
    if not whole:
        mine, theirs = _cut(mine, theirs, view, order)
    if not _count(mine, view.event_types):
        nothing = ("It has come to nothing that can be compared.",)
        return ReplayOutcome(compared, order.value, None, same=False, whole=whole, lines=nothing)
    comparison = compare_runs(mine, [theirs], view, order, tolerance=tolerance)
    report = make_report(comparison, mine, [theirs])
    lines = list(text_report(report))
    if not comparison.same and order is Order.TOTAL and _same_in_partial_order(mine, theirs, view, tolerance):
        lines.append("In partial order they are the same: --replay-order partial")
    plain = plain_report(report)
    return ReplayOutcome(compared, order.value, None, comparison.same, whole, tuple(lines), plain)


def _same_in_partial_order(mine: Run, theirs: Run, view: View, tolerance: Tolerance | None) -> bool:
    other: Comparison = compare_runs(mine, [theirs], view, Order.PARTIAL, tolerance=tolerance)
    return other.same


def _cut(mine: Run, theirs: Run, view: View, order: Order) -> tuple[Run, Run]:
    """Return the parts of two runs that can be compared when the second one is cut off.

    :raises TraceError: when there are none.
    """
    types = view.event_types if order is Order.TOTAL else (SkillStatus,)
    count = _count(theirs, types)
    if not count:
        raise TraceError(
            "it ends before the first state of a Skiller, so nothing can be compared in partial order",
            file=theirs.path,
            hint="--replay-order total compares the events that exist",
        )
    if order is Order.PARTIAL:
        count = min(count, _count(mine, types))
    return RunHead(mine, count, types), RunHead(theirs, count, types)


def _count(run: Run, types: tuple[type[Event], ...]) -> int:
    return sum(isinstance(event, types) for event in run)


class RunHead(Run):
    """The transitions of a run up to the last of so many.

    :param run: all of it.
    :param count: how many events of these types it has.
    :param types: which events are counted.
    """

    def __init__(self, run: Run, count: int, types: tuple[type[Event], ...]) -> None:
        super().__init__(run.path)
        self.format = run.format
        self._run = run
        self._count = count
        self._types = types

    def __iter__(self) -> Iterator[Event]:
        """Yield the events."""
        left = self._count
        for event in self._run:
            if isinstance(event, self._types):
                if not left:
                    return
                left -= 1
            elif not left and isinstance(event, TRANSITION_TYPES):
                return
            yield event
