"""Encoding and decoding of events as JSON: messages in mcap files and lines of ``trace cat --json``.

docs/formats.md lists the kinds of events and their fields. ``time_us`` is in microseconds since the epoch.

The output is that of :mod:`json`, which wrote the first recordings. The faster msgspec writes numbers with an
exponent, NaN and infinity differently, and refuses texts with a lone surrogate: :mod:`json` encodes events
with such values.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from functools import cache
from typing import Any, Final, get_type_hints

import msgspec

from cxbridge.event_kinds import Event

_encode_by_msgspec: Final = msgspec.json.Encoder().encode
_JSON_TYPES: Final = {int: "integer", str: "string", bool: "boolean", float: "number"}
_INTEGER_LIMIT: Final = 1 << 63  # recordings have integers of 64 bits, but msgspec accepts longer integers


class EventFormatError(ValueError):
    """A value is not an event: a field is missing or has the wrong type.

    The text is a predicate, such as ``not an event of kind goal: ...``.
    """


def encode(event: Event) -> bytes:
    """Return the event's fields as JSON on one line."""
    # most events have only texts and integers, which need no check: msgspec is the fast path
    for name in _find_checked_fields(type(event)):
        value = getattr(event, name)
        if not _has_same_json(value.values() if type(value) is dict else (value,)):
            return _encode_by_json(event)
    try:
        return _encode_by_msgspec(event)
    except UnicodeEncodeError:  # a lone surrogate in a text
        return _encode_by_json(event)


def _encode_by_json(event: Event) -> bytes:
    values = {name: getattr(event, name) for name in field_names(type(event))}
    # an enum as the field of an event becomes its value; among the values of an interface it becomes its name
    return _dump({name: value.value if isinstance(value, Enum) else value for name, value in values.items()})


def encode_with_kind(event: Event) -> bytes:
    """Return the event as JSON on one line, with its kind before the fields."""
    # the fields follow without their opening brace
    return b'{"kind":"%s",%s' % (event.KIND.name.encode(), encode(event)[1:])


def dump_json(values: Mapping[str, Any]) -> str:
    """Return values as a JSON object on one line, with the names of enum items."""
    return _dump(values).decode()


def _dump(values: Mapping[str, Any]) -> bytes:
    text = json.dumps(values_with_enum_names(values), ensure_ascii=False, separators=(",", ":"), default=str)
    # CLIPS can produce lone surrogates, which become JSON's escape sequences
    return text.encode("utf-8", "backslashreplace")


def values_with_enum_names(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an interface with the names of enum items."""
    return {name: _to_plain_value(value) for name, value in values.items()}


def _to_plain_value(value: Any) -> Any:
    """Return a value for JSON: the name of an enum item, the hexadecimal digits of bytes."""
    match value:
        case Enum():
            return value.name
        case Mapping():
            return values_with_enum_names(value)
        case list() | tuple():
            return [_to_plain_value(element) for element in value]
        case bytes() | bytearray() | memoryview():
            return value.hex()
    return value


def make_decoder(event_type: type[Event]) -> Callable[[bytes], Event]:
    """Return a function that decodes events of a type.

    :returns: the function, which raises EventFormatError for other data.
    """
    decode_by_msgspec = msgspec.json.Decoder(event_type).decode
    decoding_errors = (msgspec.MsgspecError, ValueError, RecursionError)
    integer_fields = [name for name, hint in get_type_hints(event_type).items() if hint in (int, int | None)]

    def decode(data: bytes) -> Event:
        try:
            event = decode_by_msgspec(data)
        except decoding_errors:
            event = _decode_by_json(event_type, data)
        for name in integer_fields:
            number = getattr(event, name)
            if number is not None and not -_INTEGER_LIMIT <= number < _INTEGER_LIMIT:
                raise EventFormatError(
                    f"not an event of kind {event_type.KIND.name}: {name} has more than 64 bits"
                )
        return event

    return decode


def _decode_by_json(event_type: type[Event], data: bytes) -> Event:
    """Decode a text that msgspec refuses, such as NaN or a lone surrogate, by :mod:`json`."""
    try:
        return msgspec.convert(json.loads(data), event_type)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise EventFormatError(f"not an event of kind {event_type.KIND.name}: {error}") from error


@cache
def event_json_schema(event_type: type[Event]) -> Mapping[str, Any]:
    """Return the JSON schema of a type of events."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"cxbridge.{event_type.__name__}",
        "type": "object",
        "properties": {name: {"type": json_type} for name, json_type in _find_json_types(event_type).items()},
        "required": [field.name for field in msgspec.structs.fields(event_type) if field.required],
    }


def field_names(event_type: type[Event]) -> tuple[str, ...]:
    """Return the names of the fields of a type of events, ``time_us`` first."""
    return event_type.__struct_fields__


@cache
def _find_json_types(event_type: type[Event]) -> Mapping[str, str]:
    hints = get_type_hints(event_type)  # evaluates each annotation: slower than the encoding of 100 events
    types = {}
    for name in field_names(event_type):
        hint = hints[name]
        is_enum = isinstance(hint, type) and issubclass(hint, Enum)
        types[name] = "string" if is_enum else _JSON_TYPES.get(hint, "object")
    return types


@cache
def _find_checked_fields(event_type: type[Event]) -> tuple[str, ...]:
    """Return the fields whose values msgspec may write differently from :mod:`json`."""
    return tuple(
        name for name, json_type in _find_json_types(event_type).items() if json_type in ("number", "object")
    )


def _has_same_json(values: Iterable[Any]) -> bool:
    """Return whether msgspec writes all values like :mod:`json`, apart from texts with a lone surrogate."""
    for value in values:
        value_type = type(value)
        if value_type is float:
            # within these limits both libraries write a number without an exponent
            if not (1e-4 <= value < 1e16 or value == 0.0 or -1e16 < value <= -1e-4):  # noqa: PLR2004
                return False
        elif value_type is list or value_type is tuple:
            if not _has_same_json(value):
                return False
        elif value_type is not int and value_type is not str and value_type is not bool:
            return False
    return True
