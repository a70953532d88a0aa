"""Values of documents: which are equal, and which is the greater.

The rules are MongoDB's: 1, 1.0, Int64(1) and Decimal128("1") are one value, True is another; values of
different types have an order among types. Where values are in a document is the business of `paths`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

import bson
from bson import Binary, Code, DBRef, Decimal128, Int64, MaxKey, MinKey, ObjectId, Regex, Timestamp
from bson.codec_options import CodecOptions

from cxbridge.executive.robmem.errors import QueryError

Document = dict[str, Any]
"""A document as it goes in and comes out; values are those of the package `bson`."""

MAX_BYTES = 16 * 1024 * 1024
"""The size of a document in BSON."""

MAX_DEPTH = 100
"""How deep documents and arrays may be in each other."""

_CODEC: CodecOptions[Document] = CodecOptions(tz_aware=True, tzinfo=UTC)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_LEAST_LEVEL = 8
"""Bytes of BSON that a level takes at least: type, name, size and end."""


class _MissingField:
    """Stands where a document has no value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING = _MissingField()


def encode(document: Mapping[str, Any]) -> bytes:
    """Return a document as BSON.

    :raises QueryError: when BSON has nothing like a value in it, a key is not a text, or it is too deep.
    """
    try:
        data = bson.encode(document, codec_options=_CODEC)
    except (bson.errors.BSONError, OverflowError, UnicodeError, RecursionError, TypeError) as error:
        raise QueryError(f"not a document: {error}") from None
    if len(data) > MAX_DEPTH * _LEAST_LEVEL and _is_deeper(document.values(), MAX_DEPTH):
        raise QueryError(f"a document has at most {MAX_DEPTH} levels")
    return data


def encode_stored(document: Mapping[str, Any]) -> bytes:
    """Return a document as BSON, if a collection can hold it.

    :raises QueryError: as in :func:`encode`, and when it has more than :data:`MAX_BYTES`.
    """
    data = encode(document)
    if len(data) > MAX_BYTES:
        raise QueryError(f"a document has at most {MAX_BYTES:,} bytes, this one has {len(data):,}")
    return data


def _is_deeper(values: Iterable[Any], levels: int) -> bool:
    """Whether there are more levels than that in the values."""
    inner = [value for value in values if isinstance(value, Mapping | list | tuple)]
    return bool(inner) and (
        levels == 1
        or any(_is_deeper(each.values() if isinstance(each, Mapping) else each, levels - 1) for each in inner)
    )


def decode(data: bytes) -> Document:
    """Return the document that BSON describes; times are in UTC.

    :raises QueryError: when it is none.
    """
    try:
        return bson.decode(data, codec_options=_CODEC)
    except bson.errors.BSONError as error:
        raise QueryError(f"not BSON: {error}") from None


def copy(document: Mapping[str, Any]) -> Document:
    """Return a document of its own with the same values, as BSON can hold them: times in milliseconds."""
    return decode(encode(document))


def to_ms(time: datetime) -> int:
    """Return a time as milliseconds since the epoch."""
    aware = time if time.tzinfo is not None else time.replace(tzinfo=UTC)
    delta = aware - _EPOCH
    return (delta.days * 86_400 + delta.seconds) * 1000 + delta.microseconds // 1000


def from_ms(milliseconds: int) -> datetime:
    """Return the time that is so many milliseconds after the epoch.

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
"""The key of null, and of what is not there."""

EMPTY_ARRAY: Key = (0, 0)
"""The key that an index has for an array without elements: before null."""


def _object_key(items: Iterable[tuple[str, Any]]) -> tuple[Any, ...]:
    found = []
    for name, item in items:
        place = key(item)
        # types first, then names; NaN is a number there
        found.append((NUMBERS if place == NAN else place[0], name, place))
    return tuple(found)


def _itself(value: Any) -> Any:
    return value


def _zero(_value: Any) -> int:
    return 0


_TYPES: tuple[tuple[type, int, str, Callable[[Any], Any]], ...] = (
    # subtypes precede their types: they are looked for in this order
    (MinKey, -1, "minKey", _zero),
    (type(None), 5, "null", _zero),
    (_MissingField, 5, "null", _zero),
    (bool, 40, "bool", _itself),
    (Int64, NUMBERS, "long", _itself),
    (int, NUMBERS, "int", _itself),
    (float, NUMBERS, "double", _itself),
    (Decimal128, NUMBERS, "decimal", Decimal128.to_decimal),
    (Code, 60, "javascript", lambda value: (str(value), () if value.scope is None else key(value.scope))),
    (str, 15, "string", _itself),
    (dict, 20, "object", lambda value: _object_key(value.items())),
    (DBRef, 20, "object", lambda value: _object_key(value.as_doc().items())),
    (list, 25, "array", lambda value: tuple(map(key, value))),
    (tuple, 25, "array", lambda value: tuple(map(key, value))),
    (Binary, 30, "binData", lambda value: (len(value), value.subtype, bytes(value))),
    (bytes, 30, "binData", lambda value: (len(value), 0, value)),
    (ObjectId, 35, "objectId", lambda value: value.binary),
    (datetime, 45, "date", to_ms),
    (Timestamp, 47, "timestamp", lambda value: (value.time, value.inc)),
    (Regex, 50, "regex", lambda value: (str(value.pattern), value.flags)),
    (MaxKey, 127, "maxKey", _zero),
)
_PLAIN = {str, bool, int, Int64, bytes, ObjectId}
"""Types of values that are one to the byte when Python has them equal."""

_BY_TYPE = {python: (place, name, make) for python, place, name, make in _TYPES}


def _kind(value: Any) -> tuple[int, str, Callable[[Any], Any]]:
    """Return the place of a value's type, its name, and what makes its key."""
    known = _BY_TYPE.get(type(value))
    if known is None:
        known = next((_BY_TYPE[python] for python, *_ in _TYPES if isinstance(value, python)), None)
        if known is None:
            raise QueryError(f"not a value of BSON: {value!r}")
        _BY_TYPE[type(value)] = known
    return known


def type_name(value: Any) -> str:
    """Return the name of a value's type as ``$type`` spells it."""
    name = _kind(value)[1]
    if name == "int" and not -(2**31) <= value < 2**31:
        return "long"
    return "javascriptWithScope" if name == "javascript" and value.scope is not None else name


def key(value: Any) -> Key:
    """Return something to compare and to look up a value by: equal and ordered as MongoDB has it."""
    place, _, make = _BY_TYPE.get(type(value)) or _kind(value)
    if place == NUMBERS:
        made = make(value)
        return (place, made) if made == made else NAN  # noqa: PLR0124  NaN is not equal to itself
    return (place, make(value))


def equal(one: Any, other: Any) -> bool:
    """Whether two values are one to MongoDB."""
    return key(one) == key(other)


def same(one: Any, other: Any) -> bool:
    """Whether two values are one to the byte: 1 and 1.0 are equal, but not the same."""
    if type(one) is not type(other):
        return False
    return bool(one == other) if type(one) in _PLAIN else encode({"": one}) == encode({"": other})
