"""Selection of the compared events by the patterns of ``--only`` and ``--ignore``; see docs/comparing.md.

The content of an event is the event without the fields that the patterns leave out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import translate
from typing import Final, TypeAlias

from msgspec.structs import replace

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.errors import TraceError
from cxbridge.event_kinds import EVENT_TYPES, View
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
)

ContentSelector: TypeAlias = Callable[[Event], Event | None]
"""Gets the events of one run in order; returns the compared content of each, None to leave the event out."""

# A pattern with only these fields selects goals as a whole, with their plan-actions and all states.
_WHOLE_GOAL: Final = frozenset({"id", "env", "class", "sub-type"})


def pattern_fields_by_kind() -> Mapping[str, Mapping[str, str]]:
    """Return the attributes of events by the fields that patterns can name, by kind; compared kinds first."""
    compared_types = [event_type for view in View for event_type in view.event_types]
    kinds = (event_type.KIND for event_type in (*compared_types, *EVENT_TYPES.values()))
    return {kind.name: kind.pattern_fields for kind in kinds if kind.pattern_fields}


@dataclass(frozen=True)
class EventPattern:
    """A pattern that selects events, or fields of events.

    :param field: the selected field, or a glob for the fields of an interface or the slots of a fact; empty:
        the whole event is selected.
    :param field_globs: globs that the fields of the event must match, by field.
    """

    text: str
    kind: str
    field: str
    field_globs: Mapping[str, re.Pattern[str]]

    @property
    def is_whole_goal(self) -> bool:
        """Whether the pattern selects goals with everything that belongs to them."""
        return self.kind == "goal" and not self.field and self.field_globs.keys() <= _WHOLE_GOAL

    def matches(self, kind: str, values: Mapping[str, str]) -> bool:
        """Return whether the pattern selects an event of a kind with these values, which are by field."""
        return kind == self.kind and all(
            glob.match(values.get(name, "")) is not None for name, glob in self.field_globs.items()
        )


def parse_pattern(text: str) -> EventPattern:
    """Parse ``KIND[.FIELD][:GLOB]`` or ``KIND[.FIELD]:NAME=GLOB[,NAME=GLOB...]``.

    :raises TraceError: if the kind or a field is unknown, or the field cannot be left out.
    """
    head, _, condition = text.partition(":")
    kind, _, field = head.partition(".")
    kinds = pattern_fields_by_kind()
    if kind not in kinds:
        raise TraceError(f"pattern '{text}': unknown kind '{kind}'", hint=f"use one of {', '.join(kinds)}")
    fields = kinds[kind]
    tests = dict(_parse_tests(text, condition, fields))
    if field and kind not in {"interface", "fact"} and not fields.get(field):
        raise TraceError(
            f"pattern '{text}': {kind} has no field '{field}' to leave out", hint=_known_fields_hint(fields)
        )
    globs = {name: re.compile(translate(glob)) for name, glob in tests.items()}
    return EventPattern(text, kind, field, globs)


def _parse_tests(text: str, condition: str, fields: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the fields and globs of a pattern."""
    if not condition:
        return
    if not re.match(r"[a-z-]+=", condition):
        yield next(iter(fields)), condition  # a glob alone is for the first field of the kind
        return
    # a comma separates tests only before a field, because a glob may have commas
    for test in re.split(f",(?=(?:{'|'.join(fields)})=)", condition):
        name, _, glob = test.partition("=")
        if name not in fields:
            raise TraceError(f"pattern '{text}': unknown field '{name}'", hint=_known_fields_hint(fields))
        yield name, glob


def _known_fields_hint(fields: Mapping[str, str]) -> str:
    return f"use one of {', '.join(fields)}"


class Selection:
    """The selection of events by patterns, for all compared runs; notes the patterns that matched.

    :param only: events that match no pattern are left out; empty selects all.
    :param ignore: matching events, or fields of events, are left out.
    :raises TraceError: if a pattern is invalid.
    """

    def __init__(self, only: Sequence[str] = (), ignore: Sequence[str] = ()) -> None:
        self.only = [parse_pattern(text) for text in only]
        self.ignore = [parse_pattern(text) for text in ignore]
        for pattern in self.only:
            if pattern.field:
                raise TraceError(
                    f"--only {pattern.text}: single fields can only be ignored",
                    hint=f"select {pattern.kind} events as a whole, or use --ignore {pattern.text}",
                )
        self._matched_patterns: set[str] = set()

    def __bool__(self) -> bool:
        return bool(self.only or self.ignore)

    @property
    def unused_patterns(self) -> list[str]:
        """The patterns that matched no event of the runs read so far."""
        return [
            pattern.text
            for pattern in (*self.only, *self.ignore)
            if pattern.text not in self._matched_patterns
        ]

    def content_selector(self) -> ContentSelector:
        """Return a function that selects the content of the events of one run, from its start."""
        return _SelectionReader(self, self._matched_patterns).select_content


def events_with_content(
    run: Iterable[Event], view: View, selection: Selection | None = None
) -> Iterator[tuple[Event, Event | None]]:
    """Yield all events of a run, each with its compared content; None if the event is not compared."""
    types = frozenset(view.event_types)
    select_content = selection.content_selector() if selection else None
    for event in run:
        is_compared = type(event) in types
        yield event, (select_content(event) if select_content else event) if is_compared else None


def compared_contents(
    run: Iterable[Event], view: View, selection: Selection | None = None
) -> Iterator[Event]:
    """Yield the compared content of the events of a run."""
    return (content for _, content in events_with_content(run, view, selection) if content is not None)


class _SelectionReader:
    """Selects the content of the events of one run.

    :param matched_patterns: gets the texts of the patterns that match.
    """

    def __init__(self, selection: Selection, matched_patterns: set[str]) -> None:
        self._only, self._ignore, self._matched_patterns = selection.only, selection.ignore, matched_patterns
        self._goals: dict[tuple[str, str], GoalTransition] = {}  # the last transition by environment and id
        self._last_contents: dict[object, Event] = {}  # by subject

    def select_content(self, event: Event) -> Event | None:
        """Return the compared content of the next event, or None."""
        kind = event.KIND.name
        # a pattern may select a goal with its plan-actions, which have only the id of the goal
        if isinstance(event, GoalTransition):
            self._goals[event.env, event.goal] = event
        values = self._pattern_values(event)
        content: Event | None = event
        if self._only:
            # every pattern is tried, so that each matching pattern counts as used
            matches = [self._matches(pattern, kind, event, values) for pattern in self._only]
            content = event if any(matches) else None
        for pattern in self._ignore:
            if content is not None and self._matches(pattern, kind, event, values):
                content = _remove_field(content, pattern.field) if pattern.field else None
        # without some fields, consecutive states of a subject may be equal
        return content if content is None or content is event else self._drop_repetition(content)

    def _matches(self, pattern: EventPattern, kind: str, event: Event, values: Mapping[str, str]) -> bool:
        """Return whether a pattern selects the event, or the goal to which it belongs."""
        is_match = pattern.matches(kind, values)
        if not is_match and pattern.is_whole_goal and isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            is_match = goal is not None and pattern.matches("goal", self._pattern_values(goal))
        if is_match:
            self._matched_patterns.add(pattern.text)
        return is_match

    def _pattern_values(self, event: Event) -> Mapping[str, str]:
        """Return the fields of an event by their names in patterns."""
        values = {
            name: str(getattr(event, field)) for name, field in event.KIND.pattern_fields.items() if field
        }
        if isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            values["class"] = goal.goal_class if goal else ""
        return values

    def _drop_repetition(self, event: Event) -> Event | None:
        """Return the event, or None if the event repeats the last event of its subject."""
        if not event.KIND.subject_fields:
            return event
        subject = event.KIND.name, *(getattr(event, field) for field in event.KIND.subject_fields)
        timeless_event = replace(event, time_us=0)
        if self._last_contents.get(subject) == timeless_event:
            return None
        self._last_contents[subject] = timeless_event
        return event


def _remove_field(event: Event, field: str) -> Event:
    if isinstance(event, InterfaceWrite):
        glob = re.compile(translate(field))
        return replace(
            event, values={name: value for name, value in event.values.items() if not glob.match(name)}
        )
    if isinstance(event, FactChange):
        return replace(event, text=_remove_slots(event.text, field))
    attribute = event.KIND.pattern_fields[field]
    # the empty value of the attribute's type, which is equal in all events
    return replace(event, **{attribute: type(getattr(event, attribute))()})


def _remove_slots(text: str, field: str) -> str:
    """Return the text of a fact without the slots that match a glob."""
    glob = re.compile(translate(field))
    try:
        template, slots = parse_fact(text)
    except FactSyntaxError:  # a recording may contain any text
        return text
    slot_texts = "".join(f" ({name} {value})" for name, value in slots.items() if not glob.match(name))
    return f"({template}{slot_texts})"
