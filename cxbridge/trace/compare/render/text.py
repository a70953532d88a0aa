"""Output of a comparison as text for users."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.printing import one_line
from cxbridge.trace.compare.context import read_contexts
from cxbridge.trace.compare.model import (
    Comparison,
    Difference,
    DifferenceContext,
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
    comparison: Comparison, a: Run, other_runs: Sequence[Run], selection: Selection | None = None
) -> ComparisonReport:
    """Build the report of a comparison; the runs are read again for the context of the first difference."""
    b = other_runs[comparison.other_index]
    first_difference = comparison.differences[0] if comparison.differences else None
    contexts = []
    for run, side in (
        (a, first_difference and first_difference.a),
        (b, first_difference and first_difference.b),
    ):
        position = None if side is None else side.position
        contexts.append(read_contexts(run, comparison.view, [position], selection)[position])
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
        first_difference = comparison.differences[0]
        yield ""
        yield f"first difference: {difference_title(first_difference)}"
        yield f"  A {_side_text(first_difference.a)}"
        yield f"  B {_side_text(first_difference.b)}"
        for name, _, context in report.sides:
            yield from _context_lines(name, context)
        yield from _further_lines(comparison)


def _further_lines(comparison: Comparison) -> Iterator[str]:
    """Yield a line per difference after the first."""
    further_differences = comparison.differences[1:]
    if not further_differences:
        return
    yield ""
    yield "further differences:"
    for difference in further_differences[:MAX_LISTED_DIFFERENCES]:
        yield f"  {difference_title(difference)}: A {_side_text(difference.a)}; B {_side_text(difference.b)}"
    unlisted_count = len(further_differences) - MAX_LISTED_DIFFERENCES
    if unlisted_count > 0:
        yield f"  and {unlisted_count} more"


def _difference_count_text(comparison: Comparison) -> str:
    """Return the number of differences as text."""
    noun = "place" if comparison.order is Order.TOTAL else "thing"
    count = len(comparison.differences)
    return f"{count} {noun}{'' if count == 1 else 's'}"


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


def _format_line(line: EventLine) -> str:
    return f"{line.number:6d} {line.seconds:+11.6f} {shorten(line.text)}"


def _context_lines(name: str, context: DifferenceContext) -> Iterator[str]:
    if context.lines:
        yield ""
        yield f"what led to it in {name}:"
        yield from (f"{'>' if line.here else ' '} {_format_line(line)}" for line in context.lines)
    if context.rules:
        yield f"  rules that fired just before in {name}:"
        yield from (f"    {rule}" for rule in context.rules)
    if context.goals:
        yield f"  goals at that point in {name}:"
        yield from (f"    {goal.text}" for goal in context.goals)
