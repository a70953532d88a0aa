"""Details of goals and plan-actions, such as parameters.

Each transition repeats the details. A comparison counts a detail only where it changes, so that a differing
detail is one difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.trace.compare.names import replace_times, replace_times_of_day
from cxbridge.trace.formats.base import Run

TYPES_WITH_DETAILS: Final = (GoalTransition, PlanActionTransition)
"""The types of events with details."""

MissingDetails: TypeAlias = Mapping[type[Event], frozenset[str]]
"""The details that at least one of the compared runs does not record, by type of event."""


class DetailChanges:
    """Reports details when they change.

    :param missing_details: details to report as empty.
    """

    def __init__(self, missing_details: MissingDetails | None = None) -> None:
        self._missing = missing_details or {}
        # by subject, the details as recorded and with replaced times: most details repeat, and comparing them
        # as recorded saves the replacement
        self._last_details: dict[tuple[str, ...], tuple[tuple[str, ...], tuple[str, ...]]] = {}

    def find_changed_details(self, event: Event) -> tuple[str, ...]:
        """Return the details of the next event with replaced times; unchanged details are empty."""
        kind = event.KIND
        missing_names = self._missing.get(type(event), ())
        recorded_details = tuple(
            "" if name in missing_names else getattr(event, name) for name in kind.detail_fields
        )
        subject = (kind.name, *(getattr(event, name) for name in kind.subject_fields))
        last_recorded_details, last_details = self._last_details.get(subject, (None, None))
        if last_recorded_details == recorded_details:
            return ("",) * len(recorded_details)
        details = tuple(
            replace_times(replace_times_of_day(value, event.time_us)) for value in recorded_details
        )
        self._last_details[subject] = (recorded_details, details)
        if last_details is None:
            return details
        return tuple(
            "" if detail == last_detail else detail
            for detail, last_detail in zip(details, last_details, strict=True)
        )


def find_missing_details(runs: Sequence[Run]) -> MissingDetails:
    """Return the details that the first event of each type lacks in at least one run.

    An empty text stands for a detail that a run does not record.
    """
    missing_details: dict[type[Event], frozenset[str]] = {}
    for run in runs:
        examined_types: set[type[Event]] = set()
        for event in run.select(*TYPES_WITH_DETAILS):
            event_type = type(event)
            if event_type not in examined_types:
                examined_types.add(event_type)
                empty_names = frozenset(name for name in event.KIND.detail_fields if not getattr(event, name))
                missing_details[event_type] = missing_details.get(event_type, frozenset()) | empty_names
                if len(examined_types) == len(TYPES_WITH_DETAILS):
                    break
    return missing_details
