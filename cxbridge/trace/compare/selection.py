"""Selection of the compared events by the patterns of ``--only`` and ``--ignore``; see docs/comparing.md."""

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

EventReader: TypeAlias = Callable[[Event], Event | None]
"""Takes the events of one run in order; returns the compared content of each, or None."""

_WHOLE_GOAL: Final = frozenset({"id", "env", "class", "sub-type"})


def selectable() -> Mapping[str, Mapping[str, str]]:
    """Return the fields that patterns can name, by kind of event; compared kinds first."""
    compared = [event_type for view in View for event_type in view.event_types]
    kinds = (event_type.KIND for event_type in (*compared, *EVENT_TYPES.values()))
    return {kind.name: kind.patterns for kind in kinds if kind.patterns}


@dataclass(frozen=True)
class EventPattern:
    """A pattern that selects events, or fields of events.

    :param field: a glob for the selected fields; empty: the whole event is selected.
    :param tests: globs that the fields of the event must match, by field.
    """

    text: str
    kind: str
    field: str
    tests: Mapping[str, re.Pattern[str]]

    @property
    def is_whole_goal(self) -> bool:
        """Whether the pattern selects goals with everything that belongs to them."""
        return self.kind == "goal" and not self.field and self.tests.keys() <= _WHOLE_GOAL

    def matches(self, kind: str, values: Mapping[str, str]) -> bool:
        """Return whether the pattern selects an event of this kind."""
        return kind == self.kind and all(
            test.match(values.get(name, "")) is not None for name, test in self.tests.items()
        )


def parse_pattern(text: str) -> EventPattern:
    """Parse ``KIND[.FIELD][:GLOB]`` or ``KIND[.FIELD]:NAME=GLOB[,NAME=GLOB...]``.

    :raises TraceError: if the form is different, or a name is unknown.
    """
    head, _, condition = text.partition(":")
    kind, _, field = head.partition(".")
    kinds = selectable()
    if kind not in kinds:
        raise TraceError(f"pattern '{text}': no kind '{kind}'", hint=f"use one of {', '.join(kinds)}")
    fields = kinds[kind]
    tests = dict(_parse_tests(text, condition, fields))
    if kind == "interface" and not field:
        uid = tests.get("uid", "")
        uid_glob, dot, field_glob = uid.rpartition(".")
        # `interface:UID.FIELD`; a dot before `::` is in the name of a type
        if dot and "uid=" not in condition and "::" not in field_glob:
            field, tests["uid"] = field_glob, uid_glob
    elif field and kind not in {"interface", "fact"} and not fields.get(field):
        raise TraceError(f"pattern '{text}': {kind} has no field '{field}' to leave out", hint=_hint(fields))
    globs = {name: re.compile(translate(glob)) for name, glob in tests.items()}
    return EventPattern(text, kind, field, globs)


def _parse_tests(text: str, condition: str, fields: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the fields and globs of a pattern."""
    if not condition:
        return
    if not re.match(r"[a-z-]+=", condition):
        yield next(iter(fields)), condition
        return
    # a comma separates tests only before a field, because a glob may have commas
    for test in re.split(f",(?=(?:{'|'.join(fields)})=)", condition):
        name, _, glob = test.partition("=")
        if name not in fields:
            raise TraceError(f"pattern '{text}': no field '{name}'", hint=_hint(fields))
        yield name, glob


def _hint(fields: Mapping[str, str]) -> str:
    return f"use one of {', '.join(fields)}"


class Selection:
    """The selected events of all runs, and the patterns that matched.

    :param only: events that match no pattern are left out; empty selects all.
    :param ignore: matching events, or fields of events, are left out.
    :raises TraceError: if a pattern is invalid.
    """

    def __init__(self, only: Sequence[str] = (), ignore: Sequence[str] = ()) -> None:
        self.only = [parse_pattern(text) for text in only]
        self.ignore = [parse_pattern(text) for text in ignore]
        for pattern in self.only:
            # a single field of another kind of event does not tell to which goal or plan it belongs
            if pattern.field and pattern.kind != "interface":
                raise TraceError(
                    f"--only {pattern.text}: single fields can be chosen of interfaces only",
                    hint=f"--only {pattern.kind}, and --ignore for its other fields",
                )
        self._matched: set[str] = set()

    def __bool__(self) -> bool:
        return bool(self.only or self.ignore)

    def check(self, view: View) -> None:
        """Check that ``--only`` selects events that this level compares.

        :raises TraceError: if it does not.
        """
        compared = [event_type.KIND.name for event_type in view.event_types]
        if self.only and not any(pattern.kind in compared for pattern in self.only):
            raise TraceError(
                f"--only {self.only[0].text}: the level {view.value} does not compare {self.only[0].kind}",
                hint=f"it compares {', '.join(compared)}",
            )

    @property
    def unused(self) -> list[str]:
        """The patterns that matched no event of the runs read so far."""
        return [pattern.text for pattern in (*self.only, *self.ignore) if pattern.text not in self._matched]

    def reader(self) -> EventReader:
        """Return a function for the events of one run, from its start."""
        return _SelectionReader(self, self._matched).content


def with_content(
    run: Iterable[Event], view: View, selection: Selection | None = None
) -> Iterator[tuple[Event, Event | None]]:
    """Yield all events of a run with their compared content, or None."""
    types = frozenset(view.event_types)
    content_of = selection.reader() if selection else None
    for event in run:
        is_compared = type(event) in types
        yield event, (content_of(event) if content_of is not None else event) if is_compared else None


def compared(run: Iterable[Event], view: View, selection: Selection | None = None) -> Iterator[Event]:
    """Yield the compared content of the events of a run."""
    return (content for _, content in with_content(run, view, selection) if content is not None)


class _SelectionReader:
    """Selects the events of one run; it stores goals and last events for patterns that need them."""

    def __init__(self, selection: Selection, matched: set[str]) -> None:
        self._only, self._ignore, self._matched = selection.only, selection.ignore, matched
        self._goals: dict[tuple[str, str], GoalTransition] = {}
        self._last: dict[object, Event] = {}

    def content(self, event: Event) -> Event | None:
        """Return the compared content of the next event, or None."""
        kind = event.KIND.name
        if not event.KIND.patterns:
            return event
        # a plan-action belongs to a goal that a pattern may select, and has itself only the goal's id
        if isinstance(event, GoalTransition):
            self._goals[event.env, event.goal] = event
        values = self._values(event)
        content: Event | None = event
        if self._only:
            patterns = [pattern for pattern in self._only if self._matches(pattern, kind, event, values)]
            content = _with_only_selected_fields(event, patterns) if patterns else None
        for pattern in self._ignore:
            if content is not None and self._matches(pattern, kind, event, values):
                content = _without_field(content, pattern.field) if pattern.field else None
        # without some fields, consecutive states of a subject may be equal
        return content if content is None or content is event else self._unless_repeated(content)

    def _matches(self, pattern: EventPattern, kind: str, event: Event, values: Mapping[str, str]) -> bool:
        """Return whether a pattern selects the event, or the goal to which it belongs."""
        is_match = pattern.matches(kind, values)
        if not is_match and pattern.is_whole_goal and isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            is_match = goal is not None and pattern.matches("goal", self._values(goal))
        if is_match:
            self._matched.add(pattern.text)
        return is_match

    def _values(self, event: Event) -> Mapping[str, str]:
        """Return the fields of an event by their names in patterns."""
        values = {name: str(getattr(event, field)) for name, field in event.KIND.patterns.items() if field}
        if isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            values["class"] = goal.goal_class if goal else ""
        return values

    def _unless_repeated(self, event: Event) -> Event | None:
        """Return the event, or None if it repeats the last one of its subject."""
        if not event.KIND.subject:
            return event
        subject = event.KIND.name, *(getattr(event, field) for field in event.KIND.subject)
        timeless = replace(event, time_us=0)
        if self._last.get(subject) == timeless:
            return None
        self._last[subject] = timeless
        return event


def _with_only_selected_fields(event: Event, patterns: Sequence[EventPattern]) -> Event:
    """Return an interface write with only the selected fields; other events are unchanged."""
    if not isinstance(event, InterfaceWrite) or any(not pattern.field for pattern in patterns):
        return event
    globs = [re.compile(translate(pattern.field)) for pattern in patterns]
    values = {name: value for name, value in event.values.items() if any(glob.match(name) for glob in globs)}
    return replace(event, values=values)


def _without_field(event: Event, field: str) -> Event:
    if isinstance(event, InterfaceWrite):
        glob = re.compile(translate(field))
        return replace(event, values={k: v for k, v in event.values.items() if not glob.match(k)})
    if isinstance(event, FactChange):
        return replace(event, text=_without_slot(event.text, field))
    attribute = event.KIND.patterns[field]
    return replace(event, **{attribute: type(getattr(event, attribute))()})


def _without_slot(text: str, field: str) -> str:
    """Return the text of a fact without the slots that match a glob."""
    glob = re.compile(translate(field))
    try:
        template, slots = parse_fact(text)
    except FactSyntaxError:
        return text
    slot_texts = "".join(f" ({name} {value})" for name, value in slots.items() if not glob.match(name))
    return f"({template}{slot_texts})"
