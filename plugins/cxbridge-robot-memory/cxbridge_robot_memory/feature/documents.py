"""The ``bson-*`` functions: make, read and destroy documents in CLIPS."""

from __future__ import annotations

from copy import deepcopy
from datetime import datetime
from typing import Any

from cxbridge.errors import ClipsError
from cxbridge.events import Logger
from cxbridge.executive.feature import define_logged
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value, value_text
from cxbridge_robot_memory import jsontext
from cxbridge_robot_memory.errors import RobotMemoryError
from cxbridge_robot_memory.feature.handles import Handles
from cxbridge_robot_memory.values import (
    MISSING,
    Document,
    ObjectId,
    Regex,
    Timestamp,
    from_ms,
    to_ms,
    validated_copy,
)

_INVALID = Symbol("INVALID_VALUE_TYPE")  # Fawkes' result for a value without an equivalent in CLIPS


class DocumentFunctions:
    """Defines the functions in an environment. Errors are logged and never end a right-hand side."""

    def __init__(self, env: ClipsEnvironment, handles: Handles, log: Logger) -> None:
        self._handles = handles
        self._log = log
        # the types are CLIPS' codes for the arguments: any by default (*); `sy` is a string or a symbol,
        # `m` a multifield; after an error the function returns `failure`
        for name, function, types, failure in (
            ("bson-create", self.create, "*", None),
            ("bson-parse", self.parse, "*;sy", None),
            ("bson-destroy", self.destroy, "*", None),
            ("bson-tostring", self.tostring, "*", ""),
            ("bson-append", self.append, "*;*;sy", None),
            ("bson-append-regex", self.append_regex, "*;*;sy", None),
            ("bson-append-array", self.append_array, "*;*;sy;m", None),
            ("bson-append-time", self.append_time, "*;*;sy;m", None),
            ("bson-array-start", self.array_start, "*", None),
            ("bson-array-append", self.array_append, "*", None),
            ("bson-array-finish", self.array_finish, "*;*;sy", None),
            ("bson-field-names", self.field_names, "*", (FALSE,)),
            ("bson-has-field", self.has_field, "*;*;sy", FALSE),
            ("bson-get", self.get, "*;*;sy", FALSE),
            ("bson-get-array", self.get_array, "*;*;sy", (FALSE,)),
            ("bson-get-time", self.get_time, "*;*;sy", (FALSE,)),
        ):
            define_logged(env, name, function, types, failure, lambda error: log.error(str(error)))

    def create(self) -> Value:
        return self._handles.add({})

    def parse(self, text: str) -> Value:
        """Parse JSON into a document; return an empty document after an error."""
        try:
            return self._handles.add(jsontext.parse(text))
        except RobotMemoryError as error:
            # Fawkes' text, like the texts about regular expressions and unknown types below
            self._log.error(f"Parsing JSON doc failed: {error}: {text}")
            return self._handles.add({})

    def destroy(self, doc: Value) -> None:
        """Release a document."""
        self._handles.pop(doc, dict, "bson-destroy")

    def append(self, doc: Value, field: str, value: Value) -> None:
        self._set_field(
            self._document(doc, "bson-append"), field, self._to_bson(value, f"bson-append: field {field}")
        )

    def append_regex(self, doc: Value, field: str, pattern: Value) -> None:
        """Set a field to a regular expression.

        :raises ClipsError: if the pattern is not a string.
        """
        if isinstance(pattern, Symbol) or not isinstance(pattern, str):
            raise ClipsError("Regex string has to be of type string")
        self._set_field(self._document(doc, "bson-append-regex"), field, Regex(str(pattern)))

    def append_array(self, doc: Value, field: str, values: tuple[Value, ...]) -> None:
        """Set a field to an array. Values of unknown types are left out after a warning."""
        document = self._document(doc, "bson-append-array")
        items = (self._to_bson(value, f"bson-append-array: field {field}") for value in values)
        self._set_field(document, field, [item for item in items if item is not MISSING])

    def append_time(self, doc: Value, field: str, time: tuple[Value, ...]) -> None:
        """Set a field to a time, cut to milliseconds.

        :param time: the seconds and microseconds.
        """
        match time:
            case (int() as seconds, int() as microseconds):
                self._set_field(
                    self._document(doc, "bson-append-time"),
                    field,
                    from_ms(seconds * 1000 + microseconds // 1000),
                )
            case _:
                self._log.warn(f"Invalid time: {value_text(time)}")

    def array_start(self) -> Value:
        return self._handles.add([])

    def array_append(self, array: Value, value: Value) -> None:
        items = self._handles.get(array, list, "bson-array-append")
        item = self._to_bson(value, "bson-array-append")
        if item is not MISSING:
            items.append(item)

    def array_finish(self, doc: Value, field: str, array: Value) -> None:
        """Set a field to an array, and release the array."""
        items = self._handles.pop(array, list, "bson-array-finish")
        self._set_field(self._document(doc, "bson-array-finish"), field, items)

    def _set_field(self, document: Document, field: str, value: Any) -> None:
        """Set a field to a copy of a value; do nothing for :data:`MISSING`."""
        if value is not MISSING:
            # `validated_copy` takes documents only, so the value is copied in a document of this field alone
            document[str(field)] = validated_copy({field: value})[field]

    def _to_bson(self, value: Value, place: str) -> Any:
        """Return a CLIPS value as the value of a field, or :data:`MISSING` after a warning.

        :param place: the CLIPS function and the field, for messages.
        """
        for kind in (str, float, int):
            if isinstance(value, kind):
                return kind(value)  # a Symbol becomes a str
        if isinstance(value, ExternalAddress):
            return dict(self._document(value, place))
        self._log.warn(f"{place}: tried to add unknown type to BSON")
        return MISSING

    def tostring(self, doc: Value) -> str:
        return jsontext.to_text(self._document(doc, "bson-tostring"))

    def field_names(self, doc: Value) -> Value:
        return tuple(self._document(doc, "bson-field-names"))

    def has_field(self, doc: Value, field: str) -> Value:
        """Return TRUE if a field exists, FALSE otherwise. Dots in the name descend into documents."""
        return FALSE if _value_at(self._document(doc, "bson-has-field"), field) is MISSING else TRUE

    def get(self, doc: Value, field: str) -> Value:
        """Return the value of a field; FALSE if the document lacks the field.

        Dots in the name descend into documents. A value without an equivalent in CLIPS becomes the symbol
        ``INVALID_VALUE_TYPE``.
        """
        document = self._document(doc, "bson-get")
        value = _value_at(document, field)
        if value is not MISSING:
            return self._to_clips(value) if _is_supported(value) else _INVALID
        self._log.warn(
            f"bson-get: failed to get '{field}', no such element in doc: {jsontext.to_text(document)}"
        )
        return FALSE

    def get_array(self, doc: Value, field: str) -> Value:
        """Return the elements of an array; a single FALSE if any element has no CLIPS equivalent.

        :raises ClipsError: if the field is not an array.
        """
        items = _value_at(self._document(doc, "bson-get-array"), field)
        if not isinstance(items, list):
            raise ClipsError(f"bson-get-array: field {field} is not an array")
        # check all elements first: _to_clips() makes a handle for each document, which rules must
        # release
        return tuple(map(self._to_clips, items)) if all(map(_is_supported, items)) else (FALSE,)

    def get_time(self, doc: Value, field: str) -> Value:
        """Return a time as seconds and microseconds; FALSE twice if the document lacks the field.

        :raises ClipsError: if the field is not a time.
        """
        value = _value_at(self._document(doc, "bson-get-time"), field)
        if isinstance(value, datetime):
            seconds, milliseconds = divmod(to_ms(value), 1000)
            return (seconds, milliseconds * 1000)
        if isinstance(value, Timestamp):
            return (value.time, 0)
        if value is MISSING:
            return (FALSE, FALSE)
        raise ClipsError(f"bson-get-time: field {field} is not a time")

    def _to_clips(self, value: Any) -> Value:
        """Return the CLIPS equivalent of a supported value."""
        match value:
            case bool():
                return TRUE if value else FALSE
            case dict():
                return self._handles.add(deepcopy(value))
            case ObjectId():
                return str(value)
        return value

    def _document(self, address: Value, function: str) -> Document:
        """Return a document.

        :raises ClipsError: if the address is not that of a document.
        """
        return self._handles.get(address, dict, function)


def _is_supported(value: Any) -> bool:
    return isinstance(value, bool | str | float | int | dict | ObjectId)


def _value_at(document: Document, path: str) -> Any:
    """Return the value at a dotted path through documents; :data:`MISSING` if a document lacks a name."""
    value: Any = document
    for name in path.split("."):
        if not isinstance(value, dict) or name not in value:
            return MISSING
        value = value[name]
    return value
