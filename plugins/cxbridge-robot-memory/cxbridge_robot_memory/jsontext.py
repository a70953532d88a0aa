"""Documents as MongoDB's extended JSON, also used in the embedded store's file."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.values import Document, ObjectId, Regex, Timestamp, from_ms, to_ms, validated_copy


def parse(text: str) -> Document:
    """Return the document of a JSON text.

    :raises QueryError: if the text is not a document.
    """
    try:
        document = json.loads(text, object_hook=_extended_value)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise QueryError(f"not a JSON document: {error}") from None
    if not isinstance(document, dict):
        raise QueryError("a document must be a JSON object")
    return validated_copy(document)  # which checks the names and values, and limits the depth


def _extended_value(fields: dict[str, Any]) -> Any:
    """Return the value of an extended JSON object, or the object itself."""
    # as in MongoDB's shell, an object stands for a value only if its first field begins with $
    name = next(iter(fields), "")
    if not name.startswith("$"):
        return fields
    if fields.keys() in ({"$regex"}, {"$regex", "$options"}) and isinstance(fields["$regex"], str):
        return Regex(fields["$regex"], _sorted_options(fields.get("$options", "")))
    parse_value = _PARSERS.get(name) if len(fields) == 1 else None
    return fields if parse_value is None else parse_value(fields[name])


def _sorted_options(letters: Any) -> str:
    # sorted, as in BSON, so that regular expressions with the same options are equal
    return "".join(sorted(str(letters)))


def _parse_date(value: Any) -> datetime:
    if isinstance(value, str):
        time = datetime.fromisoformat(value)
        return time if time.tzinfo else time.replace(tzinfo=UTC)
    return from_ms(int(value))


def _parse_object_id(digits: Any) -> ObjectId:
    if not isinstance(digits, str) or len(bytes.fromhex(digits)) != 12:  # noqa: PLR2004 - the bytes of an ObjectId
        raise QueryError(f"$oid must have 24 hexadecimal digits, not {digits!r}")
    return ObjectId(digits.lower())


_PARSERS: dict[str, Callable[[Any], Any]] = {
    "$oid": _parse_object_id,
    "$date": _parse_date,
    "$numberInt": int,
    "$numberLong": int,
    "$numberDouble": float,
    "$timestamp": lambda value: Timestamp(int(value["t"]), int(value["i"])),
    "$regularExpression": lambda value: Regex(str(value["pattern"]), _sorted_options(value["options"])),
    "$binary": lambda value: base64.b64decode(value["base64"], validate=True),
}


def to_text(value: Any) -> str:
    """Return a document or value in Fawkes' format: extended JSON with blanks around braces and colons."""
    if isinstance(value, dict):
        fields = ", ".join(f"{_quoted_text(name)} : {to_text(item)}" for name, item in value.items())
        return f"{{ {fields} }}" if fields else "{ }"
    if isinstance(value, list):
        items = ", ".join(map(to_text, value))
        return f"[ {items} ]" if items else "[  ]"
    format_value = next((format_value for kind, format_value in _FORMATTERS if isinstance(value, kind)), None)
    # a value of a type that only MongoDB has becomes a string
    return _quoted_text(str(value)) if format_value is None else format_value(value)


def _quoted_text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _double_text(value: float) -> str:
    return repr(value) if math.isfinite(value) else f'{{ "$numberDouble" : "{value}" }}'


# tried in order: bool precedes int, because bool is a subclass of int
_FORMATTERS: tuple[tuple[type, Callable[[Any], str]], ...] = (
    (str, _quoted_text),
    (bool, lambda value: "true" if value else "false"),
    (int, lambda value: str(int(value))),
    (float, _double_text),
    (type(None), lambda _none: "null"),
    (ObjectId, lambda value: f'{{ "$oid" : "{value}" }}'),
    (datetime, lambda value: f'{{ "$date" : {to_ms(value)} }}'),
    (Timestamp, lambda value: f'{{ "$timestamp" : {{ "t" : {value.time}, "i" : {value.inc} }} }}'),
    (Regex, lambda value: f'{{ "$regex" : {_quoted_text(value.pattern)}, "$options" : "{value.options}" }}'),
    (
        bytes,
        lambda value: (
            f'{{ "$binary" : {{ "base64" : "{base64.b64encode(value).decode()}", "subType" : "00" }} }}'
        ),
    ),
)
