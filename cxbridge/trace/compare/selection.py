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

    :param field: a glob for fields; empty selects the event.
    :param tests: globs for fields of the event.
    """

    text: str
    kind: str
    field: str
    tests: Mapping[str, re.Pattern[str]]

    @property
    def whole_goal(self) -> bool:
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
    head, _, rest = text.partition(":")
    kind, _, field = head.partition(".")
    kinds = selectable()
    if kind not in kinds:
        raise TraceError(f"pattern '{text}': no kind '{kind}'", hint=f"use one of {', '.join(kinds)}")
    known = kinds[kind]
    tests = dict(_tests(text, rest, known))
    if kind == "interface" and not field:
        uid = tests.get("uid", "")
        before, dot, after = uid.rpartition(".")
        if dot and "uid=" not in rest and "::" not in after:
            field, tests["uid"] = after, before
    elif field and kind not in {"interface", "fact"} and not known.get(field):
        raise TraceError(f"pattern '{text}': {kind} has no field '{field}' to leave out", hint=_hint(known))
    globs = {name: re.compile(translate(glob)) for name, glob in tests.items()}
    return EventPattern(text, kind, field, globs)


def _tests(text: str, rest: str, known: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the fields and globs of a pattern."""
    if not rest:
        return
    if not re.match(r"[a-z-]+=", rest):
        yield next(iter(known)), rest
        return
    for part in re.split(f",(?=(?:{'|'.join(known)})=)", rest):
        name, _, glob = part.partition("=")
        if name not in known:
            raise TraceError(f"pattern '{text}': no field '{name}'", hint=_hint(known))
        yield name, glob


def _hint(known: Mapping[str, str]) -> str:
    return f"use one of {', '.join(known)}"


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
            if pattern.field and pattern.kind != "interface":
                raise TraceError(
                    f"--only {pattern.text}: single fields can be chosen of interfaces only",
                    hint=f"--only {pattern.kind}, and --ignore for its other fields",
                )
        self._used: set[str] = set()

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
        return [each.text for each in (*self.only, *self.ignore) if each.text not in self._used]

    def reader(self) -> EventReader:
        """Return a function for the events of one run, from its start."""
        return _SelectionReader(self, self._used).take


def with_kept(
    run: Iterable[Event], view: View, selection: Selection | None = None
) -> Iterator[tuple[Event, Event | None]]:
    """Yield all events of a run with their compared content, or None."""
    types = frozenset(view.event_types)
    take = selection.reader() if selection else None
    for event in run:
        shown = type(event) in types
        yield event, (take(event) if take is not None else event) if shown else None


def compared(run: Iterable[Event], view: View, selection: Selection | None = None) -> Iterator[Event]:
    return (kept for _, kept in with_kept(run, view, selection) if kept is not None)


class _SelectionReader:
    """Selects the events of one run; it stores goals and last events for patterns that need them."""

    def __init__(self, selection: Selection, used: set[str]) -> None:
        self._only, self._ignore, self._used = selection.only, selection.ignore, used
        self._goals: dict[tuple[str, str], GoalTransition] = {}
        self._last: dict[object, Event] = {}

    def take(self, event: Event) -> Event | None:
        """Return the compared content of the next event, or None."""
        kind = event.KIND.name
        if not event.KIND.patterns:
            return event
        if isinstance(event, GoalTransition):
            self._goals[event.env, event.goal] = event
        values = self._values(event)
        kept: Event | None = event
        if self._only:
            chosen = [pattern for pattern in self._only if self._matches(pattern, kind, event, values)]
            kept = _chosen_fields(event, chosen) if chosen else None
        for pattern in self._ignore:
            if kept is not None and self._matches(pattern, kind, event, values):
                kept = _without(kept, pattern.field) if pattern.field else None
        return kept if kept is None or kept is event else self._unless_said(kept)

    def _matches(self, pattern: EventPattern, kind: str, event: Event, values: Mapping[str, str]) -> bool:
        """Return whether a pattern selects the event, or the goal to which it belongs."""
        found = pattern.matches(kind, values)
        if not found and pattern.whole_goal and isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            found = goal is not None and pattern.matches("goal", self._values(goal))
        if found:
            self._used.add(pattern.text)
        return found

    def _values(self, event: Event) -> Mapping[str, str]:
        """Return the fields of an event by their names in patterns."""
        values = {name: str(getattr(event, field)) for name, field in event.KIND.patterns.items() if field}
        if isinstance(event, PlanActionTransition):
            goal = self._goals.get((event.env, event.goal))
            values["class"] = goal.goal_class if goal else ""
        return values

    def _unless_said(self, event: Event) -> Event | None:
        """Return the event, or None if it repeats the last one of its subject."""
        if not event.KIND.subject:
            return event
        subject = event.KIND.name, *(getattr(event, field) for field in event.KIND.subject)
        bare = replace(event, time_us=0)
        if self._last.get(subject) == bare:
            return None
        self._last[subject] = bare
        return event


def _chosen_fields(event: Event, chosen: Sequence[EventPattern]) -> Event:
    """Return an interface write with only the selected fields; other events are unchanged."""
    if not isinstance(event, InterfaceWrite) or any(not pattern.field for pattern in chosen):
        return event
    globs = [re.compile(translate(pattern.field)) for pattern in chosen]
    kept = {name: value for name, value in event.values.items() if any(glob.match(name) for glob in globs)}
    return replace(event, values=kept)


def _without(event: Event, field: str) -> Event:
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
    kept = "".join(f" ({name} {value})" for name, value in slots.items() if not glob.match(name))
    return f"({template}{kept})"
