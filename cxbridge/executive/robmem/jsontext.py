"""Documents as text: MongoDB's extended JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from datetime import datetime
from typing import Any

import bson
from bson import ObjectId, Regex, Timestamp, json_util
from bson.json_util import DatetimeRepresentation, JSONMode, JSONOptions

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import Document, copy, to_ms

_OPTIONS: JSONOptions = JSONOptions(
    json_mode=JSONMode.RELAXED, tz_aware=True, datetime_representation=DatetimeRepresentation.ISO8601
)
_LETTERS = ((2, "i"), (8, "m"), (16, "s"), (64, "x"))


def parse(text: str) -> Document:
    """Return the document that a text describes.

    :raises QueryError: when it describes none.
    """
    try:
        document = json_util.loads(text, json_options=_OPTIONS)
    except (ValueError, TypeError, KeyError, RecursionError, bson.errors.BSONError) as error:
        raise QueryError(f"not a JSON document: {error}") from None
    if not isinstance(document, dict):
        raise QueryError("a document in JSON is an object, in braces")
    return copy(document)


def to_text(value: Any) -> str:
    """Return a document as Fawkes prints it: extended JSON with blanks around braces and colons."""
    if isinstance(value, dict):
        fields = ", ".join(f"{_quoted(name)} : {to_text(item)}" for name, item in value.items())
        return f"{{ {fields} }}" if fields else "{ }"
    if isinstance(value, list):
        items = ", ".join(map(to_text, value))
        return f"[ {items} ]" if items else "[  ]"
    make = next((make for kinds, make in _TEXTS if isinstance(value, kinds)), None)
    if make is None:
        return json_util.dumps(value, json_options=_OPTIONS)
    return make(value)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _double(value: float) -> str:
    return repr(value) if math.isfinite(value) else f'{{ "$numberDouble" : "{value}" }}'


def _regex(value: Regex[str]) -> str:
    letters = "".join(letter for flag, letter in _LETTERS if value.flags & flag)
    return f'{{ "$regex" : {_quoted(str(value.pattern))}, "$options" : "{letters}" }}'


_TEXTS: tuple[tuple[type, Callable[[Any], str]], ...] = (
    (str, _quoted),
    (bool, lambda value: "true" if value else "false"),
    (int, lambda value: str(int(value))),
    (float, _double),
    (type(None), lambda _value: "null"),
    (ObjectId, lambda value: f'{{ "$oid" : "{value}" }}'),
    (datetime, lambda value: f'{{ "$date" : {to_ms(value)} }}'),
    (Timestamp, lambda value: f'{{ "$timestamp" : {{ "t" : {value.time}, "i" : {value.inc} }} }}'),
    (Regex, _regex),
)
