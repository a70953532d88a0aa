"""Details of goals and plan-actions, such as parameters: when they are compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

from msgspec.structs import replace

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.trace.compare.names import without_times, without_times_of_day
from cxbridge.trace.formats.base import Run

DETAILED: Final = (GoalTransition, PlanActionTransition)
"""The types of events with details."""

Missing: TypeAlias = Mapping[type[Event], frozenset[str]]
"""The details that a run does not record, by type of event."""


class DetailNews:
    """Reports details only when they change, so that a differing detail is one difference."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, ...], tuple[tuple[str, ...], tuple[str, ...]]] = {}

    def of(self, event: Event) -> tuple[str, ...]:
        """Return the details of an event with absolute times replaced.

        Details that are equal to those of the subject's previous event are empty.
        """
        kind = event.KIND
        given = tuple(getattr(event, name) for name in kind.details)
        subject = (kind.name, *(getattr(event, name) for name in kind.subject))
        before = self._last.get(subject)
        if before is not None and before[0] == given:
            return ("",) * len(given)
        now = tuple(without_times(without_times_of_day(value, event.time_us)) for value in given)
        self._last[subject] = (given, now)
        if before is None:
            return now
        return tuple("" if new == old else new for new, old in zip(now, before[1], strict=True))


def with_common_details(runs: Sequence[Run]) -> list[Run]:
    """Return the runs without details that one of them does not record."""
    missing: dict[type[Event], frozenset[str]] = {}
    for run in runs:
        for event_type, names in _missing(run).items():
            missing[event_type] = missing.get(event_type, frozenset()) | names
    return [_WithoutDetails(run, missing) for run in runs] if any(missing.values()) else list(runs)


def _missing(run: Run) -> Missing:
    """Return the details that the first event of each type lacks."""
    found: dict[type[Event], frozenset[str]] = {}
    for event in run.select(*DETAILED):
        if type(event) not in found:
            found[type(event)] = frozenset(name for name in event.KIND.details if not getattr(event, name))
            if len(found) == len(DETAILED):
                break
    return found


class _WithoutDetails(Run):
    """A run without some details."""

    def __init__(self, run: Run, missing: Missing) -> None:
        super().__init__(run.path, run.registry)
        self.format = run.format
        self.notes = run.notes
        self._run = run
        self._blank: dict[type[Event], dict[str, Any]] = {
            kind: dict.fromkeys(names, "") for kind, names in missing.items() if names
        }

    def __iter__(self) -> Iterator[Event]:
        for event in self._run:
            blank = self._blank.get(type(event))
            yield event if blank is None else replace(event, **blank)
