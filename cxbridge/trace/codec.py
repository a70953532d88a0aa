"""Events as plain values and back: a message in an mcap file, a line of ``trace cat --json``.

Every kind of event has a name, a topic, and the names of its fields; docs/formats.md lists them. Times are
``time_us``, microseconds since the epoch.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from enum import Enum
from operator import attrgetter
from typing import Any

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)

KINDS: Mapping[str, type[Event]] = {
    "log": LogLine,
    "rule": RuleFired,
    "fact": FactChange,
    "goal": GoalTransition,
    "plan-action": PlanActionTransition,
    "skill": SkillStatus,
    "interface": InterfaceWrite,
    "message": InterfaceMessage,
    "planner": PlannerCall,
}
"""The name of each kind of event."""

NAMES: Mapping[type[Event], str] = {kind: name for name, kind in KINDS.items()}
"""The kind's name of each type of event."""

FIELDS: Mapping[type[Event], tuple[str, ...]] = {
    kind: tuple(field.name for field in fields(kind)) for kind in NAMES
}
"""The names of the fields of each type of event, ``time_us`` first."""

_GETTERS: Mapping[type[Event], Callable[[Event], tuple[Any, ...]]] = {
    kind: attrgetter(*names) for kind, names in FIELDS.items()
}
_JSON_TYPES = {"int": "integer", "str": "string", "bool": "boolean", "Level": "string"}


class EventFormatError(ValueError):
    """A value is no event: a field is missing, or of another type."""


def to_plain(event: Event) -> dict[str, Any]:
    """Return the event's fields as values that JSON knows."""
    kind = type(event)
    plain = dict(zip(FIELDS[kind], _GETTERS[kind](event)))  # noqa: B905 - equally long, and it is fast
    if kind is LogLine:
        plain["level"] = plain["level"].value
    elif kind is InterfaceWrite or kind is InterfaceMessage:
        plain["values"] = plain_values(plain["values"])
    return plain


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an interface with the items of enums by name, and all else as it is."""
    return {
        name: [_item(each) for each in value] if isinstance(value, list | tuple) else _item(value)
        for name, value in values.items()
    }


def _item(value: Any) -> Any:
    return value.name if isinstance(value, Enum) else value


def from_plain(name: str, plain: Mapping[str, Any]) -> Event:
    """Return the event of kind ``name`` with these fields.

    :raises EventFormatError: when there is no such event.
    """
    kind = KINDS.get(name)
    if kind is None:
        raise EventFormatError(f"no kind of event: {name!r}")
    try:
        values = [plain[field] for field in FIELDS[kind]]
        if kind is LogLine:
            values[_LEVEL] = Level(values[_LEVEL])
    except (KeyError, ValueError, TypeError) as error:
        raise EventFormatError(f"no event of kind {name}: {error}") from error
    types = _TYPES[kind]
    if tuple(map(type, values)) != types:
        wrong = next(i for i, value in enumerate(values) if type(value) is not types[i])
        raise EventFormatError(f"no event of kind {name}: {FIELDS[kind][wrong]} is {values[wrong]!r}")
    if abs(values[0]) >= _TIME_LIMIT:
        raise EventFormatError(f"no event of kind {name}: time_us is {values[0]!r}")
    return kind(*values)


def decoder(name: str) -> Callable[[bytes], Event]:
    """Return what makes events of kind ``name`` of their JSON.

    :returns: a function that raises EventFormatError for what is no such event.
    """

    def careful(data: bytes) -> Event:
        try:
            return from_plain(name, json.loads(data))
        except (ValueError, TypeError, RecursionError) as error:
            raise EventFormatError(str(error)) from error

    try:
        import msgspec  # noqa: PLC0415 - for those who read; it takes a while to load
    except ImportError:  # no wheel for this machine
        return careful
    fast = msgspec.json.Decoder(KINDS[name]).decode
    refused = (msgspec.MsgspecError, ValueError, RecursionError)

    def decode(data: bytes) -> Event:
        try:
            event = fast(data)
        except refused:
            return careful(data)  # json knows more (NaN), and says what is wrong
        return event if -_TIME_LIMIT < event.time_us < _TIME_LIMIT else careful(data)

    return decode


def schema_of(kind: type[Event]) -> dict[str, Any]:
    """Return the JSON schema of the plain form of events of this type."""
    properties = {field.name: {"type": _JSON_TYPES.get(str(field.type), "object")} for field in fields(kind)}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"cxbridge.{kind.__name__}",
        "type": "object",
        "properties": properties,
        "required": list(FIELDS[kind]),
    }


def dump(plain: Mapping[str, Any]) -> str:
    """Return the plain form of an event as JSON, on one line."""
    return _ENCODER.encode(plain)


def _bare(value: object) -> Any:
    """Return a value of an interface that JSON does not know in a form that it knows."""
    if isinstance(value, bytes | bytearray | memoryview):
        return value.hex()
    if isinstance(value, Mapping):
        return dict(value)
    return str(value)


_ENCODER = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"), default=_bare)

_TIME_LIMIT = 1 << 63
_LEVEL = FIELDS[LogLine].index("level")
_PLAIN_TYPES: Mapping[str, type] = {"int": int, "str": str, "bool": bool, "Level": Level}
_TYPES: Mapping[type[Event], tuple[type, ...]] = {
    kind: tuple(_PLAIN_TYPES.get(str(field.type), dict) for field in fields(kind)) for kind in NAMES
}
