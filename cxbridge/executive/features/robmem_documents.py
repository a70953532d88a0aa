"""The ``bson-*`` functions: make, read and destroy documents in CLIPS."""

from __future__ import annotations

from copy import deepcopy
from datetime import datetime
from typing import Any

from cxbridge.errors import ClipsError
from cxbridge.events import Logger
from cxbridge.executive.features.robmem_handles import Handles
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value
from cxbridge.executive.robmem import jsontext
from cxbridge.executive.robmem.errors import RobotMemoryError
from cxbridge.executive.robmem.values import (
    MISSING,
    Document,
    ObjectId,
    Regex,
    Timestamp,
    copy,
    from_ms,
    to_ms,
)

_INVALID = Symbol("INVALID_VALUE_TYPE")


class Unsupported(Exception):  # noqa: N818  no error of anybody's: CLIPS has no such value
    """The value of a document has no CLIPS equivalent."""


class DocumentFunctions:
    """Defines the functions in an environment. Errors are logged and never end a right-hand side."""

    def __init__(self, env: ClipsEnvironment, handles: Handles, log: Logger) -> None:
        self._handles = handles
        self._log = log
        for name, function, types in (
            ("bson-create", self.create, "*"),
            ("bson-parse", self.parse, "*;sy"),
            ("bson-destroy", self.destroy, "*"),
            ("bson-tostring", self.tostring, "*"),
            ("bson-append", self.append, "*;*;sy"),
            ("bson-append-regex", self.append_regex, "*;*;sy"),
            ("bson-append-array", self.append_array, "*;*;sy;m"),
            ("bson-append-time", self.append_time, "*;*;sy;m"),
            ("bson-array-start", self.array_start, "*"),
            ("bson-array-append", self.array_append, "*"),
            ("bson-array-finish", self.array_finish, "*;*;sy"),
            ("bson-field-names", self.field_names, "*"),
            ("bson-has-field", self.has_field, "*;*;sy"),
            ("bson-get", self.get, "*;*;sy"),
            ("bson-get-array", self.get_array, "*;*;sy"),
            ("bson-get-time", self.get_time, "*;*;sy"),
        ):
            count = function.__code__.co_argcount - 1
            env.define(name, function, count, types=types)

    def create(self) -> Value:
        return self._handles.add({})

    def parse(self, text: str) -> Value:
        """Parse JSON into a document; return an empty document after an error."""
        try:
            return self._handles.add(jsontext.parse(text))
        except RobotMemoryError as error:
            self._log.error(f"Parsing JSON doc failed: {error}: {text}")
            return self._handles.add({})

    def destroy(self, doc: Value) -> None:
        """Release a document."""
        try:
            self._handles.take(doc, dict, "bson-destroy")
        except ClipsError as error:
            self._log.error(str(error))

    def append(self, doc: Value, field: str, value: Value) -> None:
        document = self._document(doc, "bson-append")
        if document is not None:
            self._set_field(document, field, self._to_bson(value, f"bson-append: field {field}"))

    def append_regex(self, doc: Value, field: str, pattern: Value) -> None:
        if isinstance(pattern, Symbol) or not isinstance(pattern, str):
            self._log.error("Regex string has to be of type string")
            return
        document = self._document(doc, "bson-append-regex")
        if document is not None:
            self._set_field(document, field, Regex(str(pattern)))

    def append_array(self, doc: Value, field: str, values: tuple[Value, ...]) -> None:
        document = self._document(doc, "bson-append-array")
        if document is not None:
            items = (self._to_bson(value, f"bson-append-array: field {field}") for value in values)
            self._set_field(document, field, [item for item in items if item is not MISSING])

    def append_time(self, doc: Value, field: str, time: tuple[Value, ...]) -> None:
        """Set a field to a time with a resolution of milliseconds."""
        if len(time) != 2:  # noqa: PLR2004
            self._log.warn(f"Invalid time, {len(time)} instead of 2 entries")
            return
        if not all(isinstance(part, int) for part in time):
            self._log.warn("Invalid time, type mismatch")
            return
        document = self._document(doc, "bson-append-time")
        if document is None:
            return
        try:
            self._set_field(document, field, from_ms(time[0] * 1000 + time[1] // 1000))
        except RobotMemoryError as error:
            self._log.error(f"Failed to append time value to field {field}: {error}")

    def array_start(self) -> Value:
        return self._handles.add([])

    def array_append(self, array: Value, value: Value) -> None:
        try:
            items = self._handles.get(array, list, "bson-array-append")
        except ClipsError as error:
            self._log.error(str(error))
            return
        item = self._to_bson(value, "bson-array-append")
        if item is not MISSING:
            items.append(item)

    def array_finish(self, doc: Value, field: str, array: Value) -> None:
        """Set a field to an array, and release the array."""
        document = self._document(doc, "bson-array-finish")
        try:
            items = self._handles.take(array, list, "bson-array-finish")
        except ClipsError as error:
            self._log.error(str(error))
            return
        if document is not None:
            self._set_field(document, field, items)

    def _set_field(self, document: Document, field: str, value: Any) -> None:
        if value is MISSING:
            return
        try:
            document[str(field)] = copy({field: value})[field]
        except RobotMemoryError as error:
            self._log.error(f"Failed to append value to field {field}: {error}")

    def _to_bson(self, value: Value, where: str) -> Any:
        """Return a document's value; :data:`MISSING` after a warning if BSON has no equivalent."""
        if isinstance(value, str):
            return str(value)
        if isinstance(value, float):
            return value
        if isinstance(value, int):
            return int(value)
        if isinstance(value, ExternalAddress):
            document = self._document(value, where)
            return MISSING if document is None else dict(document)
        self._log.warn(f"{where}: tried to add unknown type to BSON")
        return MISSING

    def tostring(self, doc: Value) -> str:
        document = self._document(doc, "bson-tostring")
        return "" if document is None else jsontext.to_text(document)

    def field_names(self, doc: Value) -> Value:
        document = self._document(doc, "bson-field-names")
        return (FALSE,) if document is None else tuple(document)

    def has_field(self, doc: Value, field: str) -> Value:
        """Return whether a field exists. Dots in the name descend into documents."""
        document = self._document(doc, "bson-has-field")
        return FALSE if document is None or _field(document, field) is MISSING else TRUE

    def get(self, doc: Value, field: str) -> Value:
        """Return the value of a field. Dots in the name descend into documents."""
        document = self._document(doc, "bson-get")
        if document is None:
            return FALSE
        found = _field(document, field)
        if found is MISSING:
            self._log.warn(
                f"bson-get: failed to get '{field}', no such element in doc: {jsontext.to_text(document)}"
            )
            return FALSE
        try:
            return self._to_clips(found)
        except Unsupported:
            return _INVALID

    def get_array(self, doc: Value, field: str) -> Value:
        """Return the elements of an array; FALSE if any element has no CLIPS equivalent."""
        document = self._document(doc, "bson-get-array")
        if document is None:
            return (FALSE,)
        found = _field(document, field)
        if not isinstance(found, list):
            self._log.error(f"bson-get-array: field {field} is not an array")
            return (FALSE,)
        if not all(map(_supported, found)):
            return (FALSE,)
        return tuple(self._to_clips(item) for item in found)

    def get_time(self, doc: Value, field: str) -> Value:
        """Return a time as seconds and microseconds."""
        document = self._document(doc, "bson-get-time")
        if document is None:
            return (FALSE,)
        found = _field(document, field)
        if isinstance(found, datetime):
            seconds, milliseconds = divmod(to_ms(found), 1000)
            return (seconds, milliseconds * 1000)
        if isinstance(found, Timestamp):
            return (found.time, 0)
        if found is MISSING:
            return (FALSE, FALSE)
        self._log.error(f"bson-get-time: field {field} is not a time")
        return (FALSE,)

    def _to_clips(self, value: Any) -> Value:
        """Return the CLIPS equivalent of a document's value."""
        if isinstance(value, bool):
            return TRUE if value else FALSE
        if isinstance(value, str):
            return value
        if isinstance(value, float):
            return value
        if isinstance(value, int):
            return int(value)
        if isinstance(value, dict):
            return self._handles.add(deepcopy(value))
        if isinstance(value, ObjectId):
            return str(value)
        raise Unsupported

    def _document(self, address: Value, function: str) -> Document | None:
        """Return a document; None after a log message."""
        try:
            return self._handles.get(address, dict, function)
        except ClipsError as error:
            self._log.error(str(error))
            return None


def _supported(value: Any) -> bool:
    return isinstance(value, bool | str | float | int | dict | ObjectId)


def _field(document: Document, path: str) -> Any:
    """Return the value at a dotted path through documents."""
    found: Any = document
    for part in path.split("."):
        if not isinstance(found, dict) or part not in found:
            return MISSING
        found = found[part]
    return found
