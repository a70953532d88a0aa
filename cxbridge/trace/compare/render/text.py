"""Output of a comparison as text for users."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.printing import one_line
from cxbridge.trace.compare.context import read_context
from cxbridge.trace.compare.model import (
    AlignedRow,
    Comparison,
    Difference,
    DifferenceContext,
    DifferenceKind,
    EventLine,
    Order,
    Side,
)
from cxbridge.trace.compare.selection import Selection
from cxbridge.trace.formats.base import Run

MAX_LISTED_DIFFERENCES: Final = 10
"""The number of listed differences after the first."""

MAX_EVENT_CHARACTERS: Final = 400
"""The maximum number of displayed characters of an event."""

EVENT_NOUNS: Final = {
    "transitions": "transitions",
    "skills": "skill statuses",
    "rules": "firings",
    "facts": "fact changes",
    "blackboard": "interface writes",
}
"""The noun for the events of a level."""


@dataclass(frozen=True, slots=True)
class ComparisonReport:
    """A comparison with everything to report.

    :param a: the compared run.
    :param b: the run with which ``a`` was compared.
    :param context_a: the events, rules and goals around the first difference in A.
    :param context_b: the same for B.
    """

    comparison: Comparison
    a: Run
    b: Run
    context_a: DifferenceContext
    context_b: DifferenceContext

    @property
    def sides(self) -> tuple[tuple[str, Run, DifferenceContext], tuple[str, Run, DifferenceContext]]:
        """The name, run and context of both sides."""
        return ("A", self.a, self.context_a), ("B", self.b, self.context_b)


def make_report(
    comparison: Comparison, a: Run, others: Sequence[Run], selection: Selection | None = None
) -> ComparisonReport:
    """Build the report of a comparison; the runs are read again for the context of the first difference.

    Sets the rows of the comparison if its first difference is a message id or a time.
    """
    b = others[comparison.other]
    first = comparison.differences[0] if comparison.differences else None
    contexts = [
        read_context(run, comparison.view, None if side is None else side.position, selection)
        for run, side in ((a, first and first.a), (b, first and first.b))
    ]
    # events that differ in message id or time are partners, and so are all events before them: the lines of
    # both contexts correspond one to one
    if first and first.kind in {DifferenceKind.MSGID, DifferenceKind.TIME} and not comparison.rows:
        # one run may end just after the difference
        lines = zip(contexts[0].lines, contexts[1].lines, strict=False)
        comparison.rows = [AlignedRow(line_a, line_b, not line_a.here) for line_a, line_b in lines]
    return ComparisonReport(comparison, a, b, *contexts)


def summary(comparison: Comparison) -> str:
    """Return the result on one line."""
    noun = EVENT_NOUNS[comparison.view.value]
    order = f"{comparison.order.value} order"
    if comparison.same:
        return f"same: {comparison.count_a} {noun}, {order}"
    counts = f"A has {comparison.count_a} {noun}, B {comparison.count_b}"
    return f"differ in {_difference_count_text(comparison)}, {order}: {counts}"


def text_report(report: ComparisonReport) -> Iterator[str]:
    """Yield the lines of the report: the result and the context of the first difference."""
    return map(one_line, _report_lines(report))


def _report_lines(report: ComparisonReport) -> Iterator[str]:
    comparison = report.comparison
    yield summary(comparison)
    if not comparison.same:
        yield f"A: {report.a.path}"
        yield f"B: {report.b.path}"
        yield from (f"hint: {hint}" for hint in comparison.hints)
        first = comparison.differences[0]
        yield ""
        yield f"first difference: {difference_title(first)}"
        yield f"  A {_side_text(first.a)}"
        yield f"  B {_side_text(first.b)}"
        if comparison.rows:
            yield ""
            yield "around it (- only A, + only B):"
            yield from _row_lines(comparison.rows)
        for name, _, context in report.sides:
            yield from _context_lines(
                name, context, lines=not comparison.rows or comparison.order is Order.PARTIAL
            )
        yield from _further_lines(comparison)


def _further_lines(comparison: Comparison) -> Iterator[str]:
    """Yield a line per difference after the first."""
    further = comparison.differences[1:]
    if not further:
        return
    yield ""
    yield "further differences:"
    for difference in further[:MAX_LISTED_DIFFERENCES]:
        yield f"  {difference_title(difference)}: A {_side_text(difference.a)}; B {_side_text(difference.b)}"
    unlisted = len(further) - MAX_LISTED_DIFFERENCES + comparison.dropped
    if unlisted > 0:
        yield f"  and {unlisted} more"


def _difference_count_text(comparison: Comparison) -> str:
    """Return the number of differences as text."""
    noun = "place" if comparison.order is Order.TOTAL else "thing"
    return f"{comparison.total} {noun}{'' if comparison.total == 1 else 's'}"


def difference_title(difference: Difference) -> str:
    """Return the subject and differing parts on one line."""
    return f"{shorten(difference.subject)}: {difference.what}" if difference.subject else difference.what


def _side_text(side: Side) -> str:
    """Return the event of one run with its number."""
    text = shorten(side.text)
    return text if side.number is None else f"[{side.number}] {text}"


def shorten(text: str) -> str:
    """Shorten a long text in the middle; JSON contains it in full."""
    if len(text) <= MAX_EVENT_CHARACTERS:
        return text
    # the end matters, too: the error of a goal is last
    half = MAX_EVENT_CHARACTERS // 2
    return f"{text[:half]} ... {text[-half:]}"


def _row_lines(rows: Sequence[AlignedRow]) -> Iterator[str]:
    """Yield both runs as one list in the style of diff."""
    for row in rows:
        if row.same and row.a is not None:
            yield f"  {_format_line(row.a)}"
            continue
        for sign, line in (("-", row.a), ("+", row.b)):
            if line is not None:
                yield f"{sign} {_format_line(line)}"


def _format_line(line: EventLine) -> str:
    return f"{line.number:6d} {line.seconds:+11.6f} {shorten(line.text)}"


def _context_lines(name: str, context: DifferenceContext, *, lines: bool) -> Iterator[str]:
    if lines and context.lines:
        yield ""
        yield f"what led to it in {name}:"
        yield from (f"{'>' if line.here else ' '} {_format_line(line)}" for line in context.lines)
    if not lines and (context.rules or context.goals):
        yield ""
    if context.rules:
        yield f"  rules that fired just before in {name}:"
        yield from (f"    {rule}" for rule in context.rules)
    if context.goals:
        yield f"  goals at that point in {name}:"
        yield from (f"    {goal.text}" for goal in context.goals)
