"""A comparison as text for people and as values for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from cxbridge.trace.compare.context import Context, context_of
from cxbridge.trace.compare.result import Comparison, Difference, Order, Side
from cxbridge.trace.formats.base import Run

LISTED = 10
"""How many differences are listed after the first."""

LONGEST = 400
"""How many characters of an event are shown to people."""

_NOUNS = {
    "transitions": "transitions",
    "skills": "skill statuses",
    "rules": "firings",
    "facts": "fact changes",
    "blackboard": "interface writes",
}


def text_report(comparison: Comparison, a: Run, others: Sequence[Run]) -> Iterator[str]:
    """Yield the lines that tell a person how a comparison came out, and what led to the first difference."""
    noun = _NOUNS[comparison.view.value]
    order = f"{comparison.order.value} order"
    if comparison.same:
        yield f"same: {comparison.count_a} {noun}, {order}"
        return
    first = comparison.differences[0]
    b = others[comparison.other]
    counts = f"A has {comparison.count_a} {noun}, B {comparison.count_b}"
    yield f"differ in {_extent(comparison)}, {order}: {counts}"
    yield f"A: {a.path}"
    yield f"B: {b.path}"
    yield ""
    yield f"first difference: {_title(first)}"
    yield f"  A {_side(first.a)}"
    yield f"  B {_side(first.b)}"
    for name, run, side in (("A", a, first.a), ("B", b, first.b)):
        yield from _context(name, context_of(run, comparison.view, side.position))
    more = comparison.differences[1:]
    if more:
        yield ""
        yield "further differences:"
        for difference in more[:LISTED]:
            yield f"  {_title(difference)}: A {_side(difference.a)}; B {_side(difference.b)}"
        if len(more) > LISTED:
            yield f"  and {len(more) - LISTED} more"


def plain_report(comparison: Comparison, a: Run, others: Sequence[Run]) -> dict[str, Any]:
    """Return the outcome as values that JSON knows; numbers of events count from 1."""
    b = others[comparison.other]
    report: dict[str, Any] = {
        "same": comparison.same,
        "level": comparison.view.value,
        "order": comparison.order.value,
        "a": {"path": str(a.path), "events": comparison.count_a},
        "b": {"path": str(b.path), "events": comparison.count_b},
        "differences": [_plain(difference) for difference in comparison.differences],
    }
    if not comparison.same:
        first = comparison.differences[0]
        for name, run, side in (("a", a, first.a), ("b", b, first.b)):
            report[name]["context"] = asdict(context_of(run, comparison.view, side.position))
    return report


def _extent(comparison: Comparison) -> str:
    """Return in words how many differences there are."""
    count = len(comparison.differences)
    if comparison.order is Order.TOTAL:
        return "1 place" if count == 1 else f"{count} places"
    return "1 thing" if count == 1 else f"{count} things"


def _title(difference: Difference) -> str:
    """Return what differs."""
    return f"{_short(difference.subject)}: {difference.what}" if difference.subject else difference.what


def _side(side: Side) -> str:
    """Return what one run has, with the number of the event."""
    text = _short(side.text)
    return text if side.position is None else f"[{side.position + 1}] {text}"


def _short(text: str) -> str:
    """Return a text with its middle left out when it is too long to look at; JSON has it whole."""
    if len(text) <= LONGEST:
        return text
    half = LONGEST // 2
    return f"{text[:half]} ... {text[-half:]}"


def _plain(difference: Difference) -> dict[str, Any]:
    """Return a difference as values that JSON knows."""
    sides = {
        name: {"event": None if side.position is None else side.position + 1, "text": side.text}
        for name, side in (("a", difference.a), ("b", difference.b))
    }
    return {"subject": difference.subject, "what": difference.what, **sides}


def _context(name: str, context: Context) -> Iterator[str]:
    """Yield what led to the first difference on one side."""
    if context.lines:
        yield ""
        yield f"what led to it in {name}:"
        for line in context.lines:
            yield f"{'>' if line.here else ' '} {line.number:6d} {line.seconds:+11.6f} {_short(line.text)}"
    if context.rules:
        yield f"  rules that fired just before in {name}:"
        yield from (f"    {rule}" for rule in context.rules)
    if context.goals:
        yield f"  goals at that point in {name}:"
        yield from (f"    {goal}" for goal in context.goals)
