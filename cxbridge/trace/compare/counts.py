"""Partial order of firings and facts: no goal tells what depends on what, so it is how often each came."""

from __future__ import annotations

from cxbridge.event_kinds import View
from cxbridge.events import FactChange, RuleFired
from cxbridge.trace.compare.naming import anonymous_fact
from cxbridge.trace.compare.result import MAX_DIFFERENCES, Comparison, Difference, Kind, Order, Side
from cxbridge.trace.compare.words import judge
from cxbridge.trace.formats.base import Run


def compare_counts(a: Run, b: Run, view: View) -> Comparison:
    """Compare how often each rule fired, or each fact was asserted and retracted."""
    seen_a, seen_b = _Counts(a, view), _Counts(b, view)
    differences = []
    for text in {**seen_a.counts, **seen_b.counts}:
        count_a, count_b = seen_a.counts.get(text, 0), seen_b.counts.get(text, 0)
        if count_a != count_b:
            differences.append(
                Difference(
                    what="another number of times",
                    subject=text,
                    a=Side(seen_a.last.get(text), f"{count_a} times"),
                    b=Side(seen_b.last.get(text), f"{count_b} times"),
                    kind=Kind.COUNT,
                    count=abs(count_a - count_b),
                )
            )
    differences.sort(key=lambda difference: difference.position)
    comparison = Comparison(view, Order.PARTIAL, seen_a.total, seen_b.total, differences[:MAX_DIFFERENCES])
    comparison.dropped = len(differences) - len(comparison.differences)
    comparison.hints = judge(seen_a.scopes, seen_b.scopes)
    return comparison


class _Counts:
    """How often each thing came, and where it came last."""

    def __init__(self, run: Run, view: View) -> None:
        self.counts: dict[str, int] = {}
        self.last: dict[str, int] = {}
        self.scopes: set[str] = set()
        self.total = 0
        types = frozenset(view.event_types)
        for event in run:
            if type(event) not in types:
                continue
            if isinstance(event, RuleFired):
                text = f"{event.env}: {event.rule}"
                self.scopes.add(f"rule {event.rule}")
            elif isinstance(event, FactChange):
                arrow = "==>" if event.asserted else "<=="
                text = f"{event.env}: {arrow} {anonymous_fact(event.text)}"
                self.scopes.add(f"template {event.template}")
            else:
                continue
            self.counts[text] = self.counts.get(text, 0) + 1
            self.last[text] = self.total
            self.total += 1
