"""Total order: every event must have its like at the same place in the other run."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest

from cxbridge.events import Event, FactChange, InterfaceWrite, RuleFired, SkillStatus
from cxbridge.trace.compare.leftovers import Leftovers
from cxbridge.trace.compare.naming import Namer, describe, interface_text
from cxbridge.trace.compare.result import Comparison, Difference, Order, Side
from cxbridge.trace.formats.base import Run
from cxbridge.trace.levels import View

MAX_DIFFERENCES = 1000
"""How many differences are kept; the runs are told apart by the first."""

Skiller = tuple[str, str]


def compare_total(a: Run, b: Run, view: View) -> Comparison:
    """Compare two runs event by event, with names by first appearance. Memory does not grow with the runs."""
    lines_a, lines_b = _Lines(a, view), _Lines(b, view)
    differences: list[Difference] = []
    for line_a, line_b in zip_longest(lines_a, lines_b):
        if line_a != line_b and len(differences) < MAX_DIFFERENCES:
            differences.append(
                Difference(
                    what=_what(line_a, line_b),
                    subject="",
                    a=_side(line_a, lines_a),
                    b=_side(line_b, lines_b),
                )
            )
    return Comparison(view, Order.TOTAL, lines_a.count, lines_b.count, differences)


class _Lines:
    """The events of one view of a run as the texts that count."""

    def __init__(self, run: Run, view: View) -> None:
        self.count = 0
        self.last = ""
        self._run = run
        self._types = view.event_types
        self._namer = Namer()
        self._msgids = first_msgids(run) if SkillStatus in self._types else {}

    def __iter__(self) -> Iterator[str]:
        leftovers = Leftovers()
        for event in self._run:
            if isinstance(event, self._types):
                self.count += 1
                counts = leftovers.fresh(event) if isinstance(event, SkillStatus) else event
                if counts is not None:
                    self.last = describe(event)
                    yield self._normal(counts)

    def _normal(self, event: Event) -> str:
        """Return what counts of an event."""
        if isinstance(event, RuleFired):
            return f"{event.env}: {event.rule}"
        if isinstance(event, FactChange):
            return f"{event.env}: {event.asserted} {self._namer.rename_fact(event.text)}"
        if isinstance(event, InterfaceWrite):
            return self._namer.rename_fact(f"{event.uid} {interface_text(event, with_msgid=True)}")
        if isinstance(event, SkillStatus):
            base = self._msgids.get((event.env, event.skiller), 0)
            msgid = f"{event.msgid - base:+d}" if event.msgid else "none"
            return self._namer.rename(f"{event.skiller} {event.skill_string} {msgid} {event.status}")
        return self._namer.rename(describe(event))


def first_msgids(run: Run) -> dict[Skiller, int]:
    """Return the id of the message with which each skiller started its first skill."""
    msgids: dict[Skiller, int] = {}
    leftovers = Leftovers()
    for event in run:
        if isinstance(event, SkillStatus) and (counts := leftovers.fresh(event)) and counts.skill_string:
            msgids.setdefault((event.env, event.skiller), event.msgid)
    return msgids


def _what(line_a: str | None, line_b: str | None) -> str:
    """Return in words what differs."""
    if line_a is None:
        return "A ends here, B goes on"
    if line_b is None:
        return "B ends here, A goes on"
    return "another event"


def _side(line: str | None, lines: _Lines) -> Side:
    """Return what one run has."""
    if line is not None:
        return Side(lines.count - 1, lines.last)
    return Side(lines.count - 1 if lines.count else None, "(the run is over)")
