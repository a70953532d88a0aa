"""Reads a run again for what led to a difference."""

from __future__ import annotations

from cxbridge.event_kinds import View
from cxbridge.trace.compare.select import Selection
from cxbridge.trace.compare.trail import Context, Trail
from cxbridge.trace.formats.base import Run


def context_of(run: Run, view: View, position: int | None, selection: Selection | None = None) -> Context:
    """Read a run up to an event, and return what led to it.

    :param position: the event's number among those that are compared, from 0; None: nothing is found.
    """
    if position is None:
        return Context()
    types = frozenset(view.event_types)
    take = selection.reader() if selection else None
    trail = Trail()
    found: Context | None = None
    number = 0
    for event in run:
        shown = type(event) in types and (take is None or take(event) is not None)
        trail.take(event, number if shown else None)
        if not shown:
            continue
        if number == position:
            found = trail.context(position)
        elif found is not None and trail.settled:
            break
        number += 1
    return found or Context()
