"""Values of documents in this process: which are equal, and which is the greater.

The rules are MongoDB's: 1 and 1.0 are one value, True is another; values of different types have an order
among types. Documents hold None, bool, int of 64 bits, float, str, bytes, datetime, lists, dicts, and the
three types below; MongoDB's other types need a MongoDB.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

from msgspec import Struct

from cxbridge.executive.robmem.errors import QueryError

Document = dict[str, Any]
"""A document: fields by name."""

MAX_DEPTH = 100
"""How deep documents and arrays may be in each other."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class ObjectId(Struct, frozen=True, order=True):
    """An ``_id`` that a store made.

    :param digits: its 12 bytes as 24 hexadecimal digits.
    """

    digits: str

    def __str__(self) -> str:
        return self.digits


class Timestamp(Struct, frozen=True, order=True):
    """A time of a replica set: seconds since the epoch, and a number within the second."""

    time: int
    inc: int


class Regex(Struct, frozen=True, order=True):
    """A regular expression in a query, with options of ``imsx``."""

    pattern: str
    options: str = ""


class _MissingField:
    """Stands where a document has no value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING = _MissingField()

_SCALARS = frozenset({type(None), bool, float, str, bytes, ObjectId, Timestamp, Regex})


def copy(document: Mapping[str, Any]) -> Document:
    """Return a new document with the same values; times in UTC and milliseconds.

    :raises QueryError: when a value is none of a document's, a key is not a text, or it is too deep.
    """
    if not isinstance(document, Mapping):
        raise QueryError(f"not a document: {document!r}")
    return _copied_document(document, MAX_DEPTH)


def _copied_document(document: Mapping[str, Any], levels: int) -> Document:
    if not levels:
        raise QueryError(f"a document has at most {MAX_DEPTH} levels")
    for name in document:
        if not isinstance(name, str):
            raise QueryError(f"not a document: the name of a field is a text, not {name!r}")
    return {str(name): _copied(value, levels - 1) for name, value in document.items()}


def _copied(value: Any, levels: int) -> Any:
    if type(value) in _SCALARS:
        return value
    match value:
        case int():
            if not -(2**63) <= value < 2**63:
                raise QueryError(f"not a document: {value} has more than 64 bits")
            return int(value)
        case Mapping():
            return _copied_document(value, levels)
        case list() | tuple():
            if not levels:
                raise QueryError(f"a document has at most {MAX_DEPTH} levels")
            return [_copied(item, levels - 1) for item in value]
        case datetime():
            return from_ms(to_ms(value))
        case str():
            return str(value)
    raise QueryError(f"not a document: {value!r} needs a MongoDB")


def to_ms(time: datetime) -> int:
    """Return a time as milliseconds since the epoch."""
    aware = time if time.tzinfo is not None else time.replace(tzinfo=UTC)
    delta = aware - _EPOCH
    return (delta.days * 86_400 + delta.seconds) * 1000 + delta.microseconds // 1000


def from_ms(milliseconds: int) -> datetime:
    """Return the time of a number of milliseconds after the epoch.

    :raises QueryError: before the year 1 or after 9999.
    """
    try:
        return datetime.fromtimestamp(milliseconds // 1000, UTC).replace(
            microsecond=milliseconds % 1000 * 1000
        )
    except (ValueError, OverflowError, OSError):
        raise QueryError(f"{milliseconds} ms since the epoch is not a date") from None


# --- equality and order ---------------------------------------------------------------------------------

Key = tuple[int, Any]
"""What to compare and to look up a value by: the place of its type, and its place there."""

NUMBERS = 10

NAN: Key = (NUMBERS - 1, 0)
"""The key of NaN: below all numbers, equal to itself, and no number to ``$lt`` and its like."""

NULL: Key = (5, 0)
"""The key of null, and of a missing field."""

EMPTY_ARRAY: Key = (0, 0)
"""The key by which an array without elements is sorted: before null."""


def _object_key(items: Iterable[tuple[str, Any]]) -> tuple[Any, ...]:
    found = []
    for name, item in items:
        place = key(item)
        # types first, then names; NaN is a number there
        found.append((NUMBERS if place == NAN else place[0], name, place))
    return tuple(found)


_ORDER: dict[type, tuple[int, Callable[[Any], Any]]] = {
    type(None): (5, lambda _value: 0),
    _MissingField: (5, lambda _value: 0),
    int: (NUMBERS, lambda value: value),
    float: (NUMBERS, lambda value: value),
    str: (15, lambda value: value),
    dict: (20, lambda value: _object_key(value.items())),
    list: (25, lambda value: tuple(map(key, value))),
    bytes: (30, lambda value: (len(value), value)),
    ObjectId: (35, lambda value: value.digits),
    bool: (40, lambda value: value),
    datetime: (45, to_ms),
    Timestamp: (47, lambda value: (value.time, value.inc)),
    Regex: (50, lambda value: (value.pattern, value.options)),
}


def key(value: Any) -> Key:
    """Return something to compare and to look up a value by: equal and ordered as MongoDB has it."""
    place, make = _ORDER[type(value)]
    made = make(value)
    return NAN if place == NUMBERS and made != made else (place, made)  # noqa: PLR0124  NaN is not itself


def same(first: Any, second: Any) -> bool:
    """Whether two values are one to the byte: 1 and 1.0 are equal, but not the same."""
    if type(first) is not type(second):
        return False
    if isinstance(first, dict):
        return [*first] == [*second] and all(map(same, first.values(), second.values()))
    if isinstance(first, list):
        return len(first) == len(second) and all(map(same, first, second))
    return bool(key(first) == key(second))
