"""Encoding and decoding of events as JSON: messages in mcap files and lines of ``trace cat --json``.

Kinds of events and their fields are listed in docs/formats.md. ``time_us`` is in microseconds since the
epoch. msgspec does the work. Its output differs from that of :mod:`json`, which wrote the first recordings,
for numbers with an exponent and for NaN and infinity; these are still written in the form of :mod:`json`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from math import isfinite
from typing import Any, Final, get_type_hints

import msgspec
from msgspec.structs import replace

from cxbridge.event_kinds import Event

_PLAIN_TYPES: Final = frozenset({int, str, bool})
_JSON_TYPES: Final = {int: "integer", str: "string", bool: "boolean", float: "number"}
_INTEGER_LIMIT: Final = 1 << 63  # recordings have integers of 64 bits, but msgspec accepts longer ones


class EventFormatError(ValueError):
    """A value is not an event: a field is missing or has another type."""


def encode(event: Event) -> bytes:
    """Return the event's fields as JSON on one line."""
    event_type = type(event)
    open_fields = _open_fields[event_type] if event_type in _open_fields else _find_open_fields(event_type)
    try:
        # most events have only texts and whole numbers, whose values need no check
        for name in open_fields:
            value = getattr(event, name)
            if not _is_ready(value.values() if type(value) is dict else (value,)):
                return _encode(
                    replace(event, **{name: _prepared(getattr(event, name)) for name in open_fields})
                )
        return _encode(event)
    except UnicodeEncodeError:
        plain = {name: getattr(event, name) for name in field_names(event_type)}
        return _encode(
            {name: value if isinstance(value, Enum) else _writable(value) for name, value in plain.items()}
        )


def _prepared(value: Any) -> Any:
    """Return the value of a field in types that msgspec writes like :mod:`json`."""
    if type(value) is not dict:
        return _writable(value)
    return {
        name: element if type(element) in _PLAIN_TYPES else _writable(element)
        for name, element in value.items()
    }


def encode_with_kind(event: Event) -> bytes:
    """Return the event as JSON on one line, with its kind before the fields."""
    return b'{"kind":"%s",%s' % (event.KIND.name.encode(), encode(event)[1:])


def dump(plain: Mapping[str, Any]) -> str:
    """Return values as a JSON object on one line."""
    return _encode(_writable(plain)).decode()


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an interface with enum items by name."""
    return {
        name: [_item(element) for element in value] if isinstance(value, list | tuple) else _item(value)
        for name, value in values.items()
    }


def _item(value: Any) -> Any:
    return value.name if isinstance(value, Enum) else value


def decoder(event_type: type[Event]) -> Callable[[bytes], Event]:
    """Return a function that decodes events of a type.

    :returns: the function, which raises EventFormatError for other data.
    """
    fast = msgspec.json.Decoder(event_type).decode
    refused = (msgspec.MsgspecError, ValueError, RecursionError)
    whole_numbers = [name for name, hint in get_type_hints(event_type).items() if hint in (int, int | None)]

    def decode(data: bytes) -> Event:
        try:
            event = fast(data)
        except refused:
            event = _convert(event_type, data)
        for name in whole_numbers:
            number = getattr(event, name)
            if number is not None and not -_INTEGER_LIMIT < number < _INTEGER_LIMIT:
                raise EventFormatError(
                    f"no event of kind {event_type.KIND.name}: {name} has more than 64 bits"
                )
        return event

    return decode


def _convert(event_type: type[Event], data: bytes) -> Event:
    """Decode a text that msgspec refuses, such as NaN or a lone surrogate, by :mod:`json`."""
    try:
        return msgspec.convert(json.loads(data), event_type)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise EventFormatError(f"no event of kind {event_type.KIND.name}: {error}") from error


def schema_of(event_type: type[Event]) -> dict[str, Any]:
    """Return the JSON schema of a type of events."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"cxbridge.{event_type.__name__}",
        "type": "object",
        "properties": {name: {"type": kind} for name, kind in _json_types(event_type).items()},
        "required": [field.name for field in msgspec.structs.fields(event_type) if field.required],
    }


def field_names(event_type: type[Event]) -> tuple[str, ...]:
    """Return the names of the fields of a type of events, ``time_us`` first."""
    return event_type.__struct_fields__


def _json_types(event_type: type[Event]) -> dict[str, str]:
    hints = get_type_hints(event_type)
    types = {}
    for name in field_names(event_type):
        hint = hints[name]
        is_enum = isinstance(hint, type) and issubclass(hint, Enum)
        types[name] = "string" if is_enum else _JSON_TYPES.get(hint, "object")
    return types


def _find_open_fields(event_type: type[Event]) -> tuple[str, ...]:
    """Return the fields whose values msgspec may write differently or refuse, and cache them."""
    kinds = _json_types(event_type)
    names = tuple(name for name, kind in kinds.items() if kind in ("number", "object"))
    _open_fields[event_type] = names
    return names


def _is_ready(values: Iterable[Any]) -> bool:
    """Return whether msgspec writes all values like :mod:`json`; it refuses texts with a lone surrogate."""
    for value in values:
        kind = type(value)
        if kind is float:
            # within these limits both write a number without an exponent
            if not (1e-4 <= value < 1e16 or value == 0.0 or -1e16 < value <= -1e-4):  # noqa: PLR2004
                return False
        elif kind is list or kind is tuple:
            if not _is_ready(value):
                return False
        elif kind is not int and kind is not str and kind is not bool:
            return False
    return True


def _writable(value: Any) -> Any:
    """Return a value that msgspec writes like :mod:`json`, with enum items by name."""
    convert = _CONVERTERS.get(type(value))
    if convert is not None:
        return convert(value)
    if isinstance(value, Enum):
        return value.name
    return _ready_values(value) if isinstance(value, Mapping) else value


def _ready_text(text: str) -> str | msgspec.Raw:
    """Return a text, with a lone surrogate, which CLIPS can make, as an escape."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return msgspec.Raw(json.dumps(text, ensure_ascii=False).encode("utf-8", "backslashreplace"))
    return text


def _ready_number(number: float) -> float | msgspec.Raw:
    if _is_ready((number,)):
        return number
    return msgspec.Raw((repr(number) if isfinite(number) else json.dumps(number)).encode())


def _ready_values(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _writable(value) for name, value in values.items()}


def _ready_list(values: list[Any] | tuple[Any, ...]) -> list[Any]:
    return [_writable(value) for value in values]


_CONVERTERS: Final[dict[type, Callable[[Any], Any]]] = {
    str: _ready_text,
    float: _ready_number,
    dict: _ready_values,
    list: _ready_list,
    tuple: _ready_list,
    **dict.fromkeys((int, bool), lambda value: value),
    bytes: bytes.hex,
    bytearray: bytearray.hex,
    memoryview: memoryview.hex,
}
_encode: Final = msgspec.json.Encoder(enc_hook=str).encode
_open_fields: Final[dict[type[Event], tuple[str, ...]]] = {}
