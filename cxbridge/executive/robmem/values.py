"""Values of documents: which are equal, which is the greater, and where they are in a document.

The rules are MongoDB's: 1, 1.0 and Int64(1) are one value, True is another; values of different types have an
order among types; a path with dots goes through documents, array indexes and the elements of arrays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Any

import bson
from bson import Binary, MaxKey, MinKey, ObjectId, Regex, Timestamp
from bson.codec_options import CodecOptions

from cxbridge.executive.robmem.errors import QueryError

Document = dict[str, Any]
"""A document as it goes in and comes out; values are those of the package `bson`."""

_CODEC: CodecOptions[Document] = CodecOptions(tz_aware=True, tzinfo=UTC)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class _Missing:
    """Stands where a document has no value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING = _Missing()


def encode(document: Mapping[str, Any]) -> bytes:
    """Return a document as BSON.

    :raises QueryError: when BSON has nothing like a value in it, or a key is no text.
    """
    try:
        return bson.encode(document, codec_options=_CODEC)
    except (bson.errors.BSONError, OverflowError, UnicodeError, RecursionError, TypeError) as error:
        raise QueryError(f"not a document: {error}") from None


def decode(data: bytes) -> Document:
    """Return the document that BSON tells of; times are in UTC.

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
        raise QueryError(f"{milliseconds} ms since the epoch is no date") from None


# --- equality and order ---------------------------------------------------------------------------------

_RANKS: tuple[tuple[int, str, tuple[type, ...]], ...] = (
    # bool before the numbers: it is an int in Python
    (8, "bool", (bool,)),
    (2, "number", (int, float)),
    (3, "string", (str,)),
    (4, "object", (dict,)),
    (5, "array", (list, tuple)),
    (7, "objectId", (ObjectId,)),
    (9, "date", (datetime,)),
    (10, "timestamp", (Timestamp,)),
    (11, "regex", (Regex,)),
    (6, "binData", (bytes, Binary)),
    (0, "minKey", (MinKey,)),
    (12, "maxKey", (MaxKey,)),
)
_BY_TYPE: dict[type, tuple[int, str]] = {
    python: (rank, name) for rank, name, types in _RANKS for python in types
}
_NULL = (1, "null")


def _kind(value: Any) -> tuple[int, str]:
    """Return where the type of a value stands in the order of types, and its name."""
    if value is None or value is MISSING:
        return _NULL
    known = _BY_TYPE.get(type(value))
    if known is None:
        known = next(((rank, name) for rank, name, types in _RANKS if isinstance(value, types)), None)
        if known is None:
            return (11, type(value).__name__)
        _BY_TYPE[type(value)] = known
    return known


def rank(value: Any) -> int:
    """Return where the type of a value stands in the order of types; numbers share one place."""
    return _kind(value)[0]


def type_name(value: Any) -> str:
    """Return the name of a value's type as ``$type`` spells it; ``number`` for any number."""
    return _kind(value)[1]


def _number_key(value: float) -> tuple[float, float]:
    # NaN is below all numbers and equal to itself
    return (0, 0.0) if isinstance(value, float) and math.isnan(value) else (1, value)


_KEYS: dict[str, Callable[[Any], Any]] = {
    "bool": bool,
    "number": _number_key,
    "string": str,
    "object": lambda value: tuple((rank(item), name, key(item)) for name, item in value.items()),
    "array": lambda value: tuple(key(item) for item in value),
    "objectId": lambda value: value.binary,
    "date": to_ms,
    "timestamp": lambda value: (value.time, value.inc),
    "regex": lambda value: (str(value.pattern), value.flags),
    "binData": lambda value: (len(value), getattr(value, "subtype", 0), bytes(value)),
    "null": lambda _value: 0,
    "minKey": lambda _value: 0,
    "maxKey": lambda _value: 0,
}


def key(value: Any) -> tuple[int, Any]:
    """Return something to compare and to look up a value by: equal and ordered as MongoDB has it."""
    place, name = _kind(value)
    make = _KEYS.get(name)
    return (place, make(value) if make is not None else (name, repr(value)))


def equal(one: Any, other: Any) -> bool:
    """Whether two values are one to MongoDB."""
    return key(one) == key(other)


# --- paths ------------------------------------------------------------------------------------------------


def values_at(document: Any, path: str) -> Iterator[Any]:
    """Yield the values that a path leads to; :data:`MISSING` for each way that ends early.

    Arrays on the way are entered, by index where the path has one; one at its end is yielded as it is.
    """
    if "." not in path:
        yield document.get(path, MISSING)
        return
    yield from _walk(document, path.split("."), 0)


def _walk(value: Any, parts: list[str], at: int) -> Iterator[Any]:
    if at == len(parts):
        yield value
    elif isinstance(value, dict):
        if parts[at] in value:
            yield from _walk(value[parts[at]], parts, at + 1)
        else:
            yield MISSING
    elif isinstance(value, list):
        if parts[at].isdigit() and int(parts[at]) < len(value):
            yield from _walk(value[int(parts[at])], parts, at + 1)
        documents = [item for item in value if isinstance(item, dict)]
        for item in documents:
            yield from _walk(item, parts, at)
        if not documents and not parts[at].isdigit():
            yield MISSING
    else:
        yield MISSING


def index_keys(document: Document, path: str) -> set[Hashable]:
    """Return the keys under which an index on a path knows a document: each value, and each of an array."""
    keys: set[Hashable] = set()
    for value in values_at(document, path):
        keys.add(key(value))
        if isinstance(value, list):
            keys.update(key(item) for item in value)
    return keys
