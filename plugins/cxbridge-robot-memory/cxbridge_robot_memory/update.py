"""Updates of the embedded store: operators on dotted paths.

Operators follow MongoDB's documentation. Unsupported operators, and paths with an index of an array, are
refused by name, before any document is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from itertools import pairwise
from typing import Any, Final, NamedTuple

from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.query import equalities, has_operators, mongodb_needed_error, split_path
from cxbridge_robot_memory.values import MISSING, Document, is_identical, validated_copy

_OPERATORS: Final = frozenset({"$set", "$unset", "$inc", "$push", "$currentDate"})


class _UpdateStep(NamedTuple):
    """The change of one operator at one path."""

    operator: str
    path: str
    operand: Any

    def new_value(self, current_value: Any, now: datetime) -> Any:
        """Return the new value at the path; :data:`MISSING` removes the field."""
        match self.operator:
            case "$unset":
                return MISSING
            case "$currentDate":
                return now
            case "$inc" if current_value is not MISSING:
                return self._increment(current_value)
            case "$push":
                return self._append(current_value)
            case _:
                return self.operand

    def _increment(self, current_value: Any) -> Any:
        if not _is_number(current_value):
            raise QueryError(f"$inc: '{self.path}' is not a number")
        result = current_value + self.operand
        if isinstance(result, int) and not -(2**63) <= result < 2**63:
            raise QueryError(f"$inc: '{self.path}' would be {result}, which does not fit into 64 bits")
        return result

    def _append(self, current_value: Any) -> list[Any]:
        if current_value is MISSING:
            return [self.operand]
        if not isinstance(current_value, list):
            raise QueryError(f"$push: '{self.path}' is not an array")
        return [*current_value, self.operand]


def to_operators(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return an update as operators. Plain fields become ``$set``."""
    if any(name.startswith("$") for name in changes):
        return dict(changes)
    return {"$set": dict(changes)}


class Update:
    """An update.

    :param changes: operators, or plain fields to set.
    :raises QueryError: if an operator or path needs MongoDB, a path or operand is invalid, or paths conflict.
    """

    def __init__(self, changes: Mapping[str, Any]) -> None:
        steps = [
            step for name, fields in to_operators(changes).items() for step in _parse_steps(name, fields)
        ]
        # as in MongoDB, new fields are added in the order of their names
        self._sorted_steps = sorted(steps, key=lambda step: step.path.split("."))
        # a dot ends each path, so that the path `a` is not a prefix of the path `ab`
        for outer_path, inner_path in pairwise(sorted(f"{step.path}." for step in steps)):
            if inner_path.startswith(outer_path):
                raise QueryError(
                    f"updating the path '{inner_path[:-1]}' would create a conflict at '{outer_path[:-1]}'"
                )

    def apply(self, document: Document, now: datetime) -> Document | None:
        """Return the changed copy of a document; None if the update changes nothing.

        :raises QueryError: if the update does not suit the document.
        """
        changed_document = validated_copy(document)
        has_changes = False
        for step in self._sorted_steps:
            has_changes |= _apply_step(step, changed_document, now)
        if any("." in step.path for step in self._sorted_steps):
            validated_copy(changed_document)  # refuses a document that has become too deep
        if "_id" in document and not is_identical(document["_id"], changed_document.get("_id", MISSING)):
            raise QueryError("an update cannot change the '_id' of a document")
        return changed_document if has_changes else None

    def new_document(self, query: Mapping[str, Any], now: datetime) -> Document:
        """Return the document that an upsert inserts: the query's equalities, changed by the update.

        :raises QueryError: if the equalities conflict, or as in :meth:`apply`.
        """
        query_document: Document = {}
        # only by path, since values may have no order
        for path, value in sorted(equalities(query), key=lambda equality: equality[0]):
            _set_value(query_document, path, value)
        changed_document = self.apply(query_document, now)
        return query_document if changed_document is None else changed_document


def _parse_steps(name: str, fields: Any) -> Iterator[_UpdateStep]:
    if name not in _OPERATORS:
        raise mongodb_needed_error(f"{name} in an update")
    if not isinstance(fields, Mapping):
        raise QueryError(f"{name} must have a document of fields")
    for path, operand in fields.items():
        names = split_path(path)
        if not all(names):
            raise QueryError(f"{name}: '{path}' is not a path, because a part of it is empty")
        if any(field_name.startswith("$") for field_name in names):
            raise mongodb_needed_error(f"{name} of '{path}', a path with a dollar,")
        if name == "$inc" and not _is_number(operand):
            raise QueryError(f"$inc of '{path}' must be a number")
        if name == "$currentDate" and not isinstance(operand, bool):
            raise mongodb_needed_error(f"$currentDate of '{path}' with a value other than a boolean")
        if name == "$push" and has_operators(operand):
            raise mongodb_needed_error(f"$push of '{path}' with {next(iter(operand))}")
        yield _UpdateStep(name, path, operand)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)  # isinstance() would accept True and False


def _apply_step(step: _UpdateStep, document: Document, now: datetime) -> bool:
    """Apply a step to a document; return whether the document has changed."""
    *parents, name = step.path.split(".")
    parent: Any = document
    for field_name in parents:
        parent = parent.get(field_name) if isinstance(parent, dict) else None
    current_value = parent.get(name, MISSING) if isinstance(parent, dict) else MISSING
    new_value = step.new_value(current_value, now)
    if new_value is MISSING:
        if current_value is MISSING:
            return False
        del parent[name]
        return True
    # $currentDate always counts as a change: on a virtual clock, the time may be the same as before
    if (
        step.operator != "$currentDate"
        and current_value is not MISSING
        and is_identical(current_value, new_value)
    ):
        return False
    _set_value(document, step.path, new_value)
    return True


def _set_value(document: Document, path: str, value: Any) -> None:
    """Set a value, creating documents on the path."""
    *parents, name = path.split(".")
    parent: Any = document
    for field_name in parents:
        parent = parent.setdefault(field_name, {})
        if not isinstance(parent, dict):
            raise QueryError(f"cannot set '{path}': '{field_name}' is not a document")
    parent[name] = value
