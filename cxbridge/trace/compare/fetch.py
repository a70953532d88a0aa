"""Reads single events of a run again, to show them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from cxbridge.event_kinds import View
from cxbridge.events import Event
from cxbridge.trace.compare.select import Selection
from cxbridge.trace.formats.base import Run


@dataclass(frozen=True, slots=True)
class EventReader:
    """Knows which events of a run are compared, and so their numbers."""

    run: Run
    view: View
    selection: Selection | None = None

    def events(self, numbers: Collection[int]) -> dict[int, Event]:
        """Return the events with these numbers, from 0; the run is read up to the last of them."""
        found: dict[int, Event] = {}
        if not numbers:
            return found
        wanted, last = set(numbers), max(numbers)
        types = frozenset(self.view.event_types)
        take = self.selection.reader() if self.selection else None
        number = 0
        for event in self.run:
            if type(event) not in types:
                continue
            kept = take(event) if take else event
            if kept is None:
                continue
            if number in wanted:
                found[number] = kept
            if number >= last:
                break
            number += 1
        return found
