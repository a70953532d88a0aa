"""Details of goals and plan-actions, such as parameters: a comparison counts each detail where it changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.trace.compare.names import without_times, without_times_of_day
from cxbridge.trace.formats.base import Run

DETAILED: Final = (GoalTransition, PlanActionTransition)
"""The types of events with details."""

MissingDetails: TypeAlias = Mapping[type[Event], frozenset[str]]
"""The details that at least one of the compared runs does not record, by type of event."""


class DetailChanges:
    """Reports details only when they change, so that a differing detail is one difference.

    :param missing: details that are always empty.
    """

    def __init__(self, missing: MissingDetails | None = None) -> None:
        self._missing = missing or {}
        # by subject: the recorded details, which are compared first, because replacing their times takes long
        self._last: dict[tuple[str, ...], tuple[tuple[str, ...], tuple[str, ...]]] = {}

    def of(self, event: Event) -> tuple[str, ...]:
        """Return the details of the next event with absolute times replaced; unchanged details are empty."""
        kind = event.KIND
        missing = self._missing.get(type(event), ())
        recorded = tuple("" if name in missing else getattr(event, name) for name in kind.details)
        subject = (kind.name, *(getattr(event, name) for name in kind.subject))
        former = self._last.get(subject)
        if former is not None and former[0] == recorded:
            return ("",) * len(recorded)
        details = tuple(without_times(without_times_of_day(value, event.time_us)) for value in recorded)
        self._last[subject] = (recorded, details)
        if former is None:
            return details
        return tuple("" if new == old else new for new, old in zip(details, former[1], strict=True))


def missing_details(runs: Sequence[Run]) -> MissingDetails:
    """Return the details that the first event of each type lacks in at least one of the runs."""
    missing: dict[type[Event], frozenset[str]] = {}
    for run in runs:
        examined: set[type[Event]] = set()
        for event in run.select(*DETAILED):
            kind = type(event)
            if kind not in examined:
                examined.add(kind)
                empty = frozenset(name for name in event.KIND.details if not getattr(event, name))
                missing[kind] = missing.get(kind, frozenset()) | empty
                if len(examined) == len(DETAILED):
                    break
    return missing
