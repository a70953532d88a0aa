"""Changes of runs that comparisons must find, and changes that comparisons must ignore."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from random import Random
from typing import Any, TypeVar, cast

from msgspec.structs import replace

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    SkillStatus,
)
from cxbridge.history.transitions import Transition

E = TypeVar("E", bound=Event)

Mutation = Callable[[list[Transition], Random], list[Transition] | None]
"""Returns a changed copy, or None if the chosen event does not allow the change."""


def thread(event: Transition) -> tuple[str, ...]:
    """Return the thread of the event: a goal, a plan or a skiller."""
    if isinstance(event, GoalTransition):
        return ("goal", event.goal)
    if isinstance(event, PlanActionTransition):
        return ("plan", event.goal, event.plan)
    return ("skiller", event.skiller)


def state(event: Transition) -> tuple[str, ...]:
    """Return the part of the event that counts in partial order within its thread."""
    if isinstance(event, GoalTransition):
        return (event.mode, event.outcome, event.error)
    if isinstance(event, PlanActionTransition):
        return (event.action_id, event.action, event.state)
    return (event.skill_string, event.status)


def _neighbour(events: list[Transition], at: int, step: int) -> int | None:
    """Return the index of the previous (-1) or next (1) event of the same thread."""
    places = range(at + 1, len(events)) if step > 0 else range(at - 1, -1, -1)
    return next((i for i in places if thread(events[i]) == thread(events[at])), None)


def drop(events: list[Transition], random: Random) -> list[Transition] | None:
    at = random.randrange(len(events))
    around = (_neighbour(events, at, -1), _neighbour(events, at, 1))
    if any(i is not None and state(events[i]) == state(events[at]) for i in around):
        return None  # only the parent changes here
    return events[:at] + events[at + 1 :]


def swap(events: list[Transition], random: Random) -> list[Transition] | None:
    at = random.randrange(len(events))
    other = _neighbour(events, at, 1)
    if other is None or state(events[at]) == state(events[other]):
        return None
    changed = list(events)
    changed[at], changed[other] = changed[other], changed[at]
    return changed


def _alter_field(kind: type[Event], field: str, values: list[str]) -> Mutation:
    def alter(events: list[Transition], random: Random) -> list[Transition] | None:
        at = random.randrange(len(events))
        value = random.choice(values)
        if not isinstance(events[at], kind) or getattr(events[at], field) == value:
            return None
        changed: dict[str, Any] = {field: value}
        return [*events[:at], replace(events[at], **changed), *events[at + 1 :]]

    alter.__name__ = f"alter_{field}"
    return alter


def orphan(events: list[Transition], random: Random) -> list[Transition] | None:
    """Remove a goal's parent for the rest of the run."""
    at = random.randrange(len(events))
    goal = events[at]
    if not isinstance(goal, GoalTransition) or goal.parent == "nil" or _neighbour(events, at, 1) is not None:
        return None
    return [*events[:at], replace(goal, parent="nil"), *events[at + 1 :]]


MUTATIONS: list[Mutation] = [
    drop,
    swap,
    orphan,
    _alter_field(GoalTransition, "mode", ["FORMULATED", "SELECTED", "EXPANDED", "FINISHED", "ODD"]),
    _alter_field(GoalTransition, "outcome", ["COMPLETED", "FAILED", "REJECTED"]),
    _alter_field(GoalTransition, "error", ["ODD", "SUB-GOAL-FAILED gen8"]),
    _alter_field(GoalTransition, "goal_class", ["ODD"]),
    _alter_field(GoalTransition, "params", ["(odd)", "()"]),
    _alter_field(GoalTransition, "meta", ["(odd)"]),
    _alter_field(GoalTransition, "priority", ["77.0"]),
    _alter_field(GoalTransition, "resources", ["(odd)"]),
    _alter_field(PlanActionTransition, "params", ["(odd)", '("with text")']),
    _alter_field(PlanActionTransition, "state", ["PENDING", "RUNNING", "FINAL", "EXECUTION-FAILED"]),
    _alter_field(PlanActionTransition, "action", ["odd"]),
    _alter_field(PlanActionTransition, "action_id", ["15"]),
    _alter_field(SkillStatus, "skill_string", ["", 'say{text="odd"}']),
    _alter_field(SkillStatus, "status", ["S_INACTIVE", "S_FAILED"]),
]


_GENSYM = re.compile(r"\bgen\d+\b")
_UUID = re.compile(r"\b[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}\b")
_INDEX = re.compile(r"(?<=<Fact-)\d+|(?<=-idx )[1-9]\d*|(?<=\(meta-fact )[1-9]\d*")
_TIME = re.compile(r"\b(\d{10})((?:\.\d+)|(?: (?:INTEGER )?\d{1,6}))?\b")
_MSGID = re.compile(r"(?<=\(msgid )[1-9]\d*")


def distinct(random: Random, below: int) -> Iterator[int]:
    """Yield distinct random numbers from 1."""
    drawn = {0}
    while len(drawn) < below:
        number = random.randrange(1, below)
        if number not in drawn:
            drawn.add(number)
            yield number


class Renaming:
    """Renames all generated names, and gives each event another time."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._names: dict[str, str] = {}
        self._numbers = distinct(random, 100_000)
        self._msgid = random.randrange(1, 500)
        self._now = random.randrange(10**15)
        self._start_s = random.randrange(10**9, 9 * 10**9)

    def __call__(self, event: Event) -> Event:
        self._now += self._random.randrange(1_000_000)
        changed: dict[str, Any] = {"time_us": self._now}
        for name in ("goal", "parent", "error", "plan", "text", "skill_string", "params", "meta"):
            if (value := getattr(event, name, None)) is not None:
                changed[name] = self._text(value)
        if isinstance(event, FactChange):
            changed["index"] = event.index + self._msgid
        elif isinstance(event, SkillStatus):
            changed["msgid"] = event.msgid and event.msgid + self._msgid
        elif isinstance(event, InterfaceWrite):
            changed["values"] = {name: self._value(name, value) for name, value in event.values.items()}
        return replace(event, **changed)

    def _value(self, name: str, value: Any) -> Any:
        if name == "msgid":
            return value and value + self._msgid
        return self._text(value) if isinstance(value, str) else value

    def _text(self, text: str) -> str:
        text = _GENSYM.sub(lambda match: self._name(match.group(), "gen{}"), text)
        text = _UUID.sub(lambda match: self._name(match.group(), "{:08x}-1234-4567-89ab-0123456789ab"), text)
        text = _INDEX.sub(lambda match: self._name(f"f-{match.group()}", "{}"), text)
        text = _MSGID.sub(lambda match: str(int(match.group()) + self._msgid), text)
        return _TIME.sub(self._time, text)

    def _name(self, old: str, form: str) -> str:
        if old not in self._names:
            self._names[old] = form.format(next(self._numbers))
        return self._names[old]

    def _time(self, match: re.Match[str]) -> str:
        second = self._start_s + self._random.randrange(1000)
        if not match[2]:
            return str(second)
        return f"{second}{match[2][: -len(match[2].split()[-1])]}{self._random.randrange(10**6)}"


def renumber(events: Sequence[E], random: Random) -> list[E]:
    """Return events with other ids, UUIDs, fact indices, message ids and times."""
    renaming = Renaming(random)
    return [cast("E", renaming(event)) for event in events]


def shuffle(events: list[Transition], random: Random, steps: int = 3000) -> list[Transition]:
    """Return events after many exchanges of independent neighbours."""
    parents = {event.goal: event.parent for event in events if isinstance(event, GoalTransition)}
    changed = list(events)
    for _ in range(steps):
        at = random.randrange(len(changed) - 1)
        if _independent(changed[at], changed[at + 1], parents):
            changed[at], changed[at + 1] = changed[at + 1], changed[at]
    return changed


def _independent(first: Transition, second: Transition, parents: dict[str, str]) -> bool:
    goals = [getattr(event, "goal", "") for event in (first, second)]
    if goals[0] == goals[1] or parents.get(goals[0]) == goals[1] or parents.get(goals[1]) == goals[0]:
        return False
    return thread(first) != thread(second)
