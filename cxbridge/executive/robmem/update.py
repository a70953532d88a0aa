"""Updates of the embedded store: operators on dotted paths.

Operators follow MongoDB's documentation. Unsupported operators, and paths with an index of an array, are
refused by name, before any document is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from itertools import pairwise
from typing import Any, Final, NamedTuple

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.query import equalities, has_operators, names_of_path, needs_mongodb
from cxbridge.executive.robmem.values import MISSING, Document, copy, same

_OPERATORS: Final = frozenset({"$set", "$unset", "$inc", "$push", "$currentDate"})


@dataclass
class Changed:
    """The result of an update.

    :param document: the new document; the old one stays unchanged.
    :param fields: new values by path.
    """

    document: Document
    fields: Document = field(default_factory=dict)
    removed: list[str] = field(default_factory=list)

    @property
    def anything(self) -> bool:
        return bool(self.fields or self.removed)


class _UpdateStep(NamedTuple):
    """The change of one operator at one path."""

    operator: str
    path: str
    operand: Any

    def new_value(self, old: Any, now: datetime) -> Any:
        """Return the new value at the path; :data:`MISSING` removes the field."""
        match self.operator:
            case "$unset":
                return MISSING
            case "$currentDate":
                return now
            case "$inc" if old is not MISSING:
                return self._increment(old)
            case "$push":
                return self._append(old)
            case _:
                return self.operand

    def _increment(self, old: Any) -> Any:
        if not _is_number(old):
            raise QueryError(f"$inc: '{self.path}' is not a number")
        result = old + self.operand
        if isinstance(result, int) and not -(2**63) <= result < 2**63:
            raise QueryError(f"$inc: '{self.path}' would be {result}, more than an integer can hold")
        return result

    def _append(self, old: Any) -> list[Any]:
        if old is MISSING:
            return [self.operand]
        if not isinstance(old, list):
            raise QueryError(f"$push: '{self.path}' is not an array")
        return [*old, self.operand]


def as_operators(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return an update as operators. Plain fields become ``$set``."""
    if any(name.startswith("$") for name in changes):
        return dict(changes)
    return {"$set": dict(changes)}


class Update:
    """An update.

    :param changes: operators, or plain fields to set.
    :raises QueryError: if an operator needs a MongoDB, an operand is invalid, or paths conflict.
    """

    def __init__(self, changes: Mapping[str, Any]) -> None:
        steps = [step for name, fields in as_operators(changes).items() for step in _steps(name, fields)]
        # as in MongoDB, new fields are added in the order of their names
        self._steps = sorted(steps, key=lambda step: step.path.split("."))
        # the dot ends the last name, so that `a` is no prefix of `ab`
        for outer, inner in pairwise(sorted(f"{step.path}." for step in steps)):
            if inner.startswith(outer):
                raise QueryError(
                    f"updating the path '{inner[:-1]}' would create a conflict at '{outer[:-1]}'"
                )

    def apply(self, document: Document, now: datetime) -> Changed:
        """Apply the update to a copy of a document.

        :raises QueryError: if the update does not suit the document.
        """
        result = Changed(copy(document))
        for step in self._steps:
            _apply_step(step, result, now)
        if any("." in step.path for step in self._steps):
            copy(result.document)  # refuses a document that has become too deep
        if "_id" in document and not same(document["_id"], result.document.get("_id", MISSING)):
            raise QueryError("an update cannot change the '_id' of a document")
        return result

    def new_document(self, query: Mapping[str, Any], now: datetime) -> Document:
        """Return the document of an upsert: the query's equalities, then the update.

        :raises QueryError: if the query requires two values at one path.
        """
        values: dict[str, Any] = {}
        for path, value in equalities(query):
            for other in values:
                if f"{path}.".startswith(f"{other}.") or other.startswith(f"{path}."):
                    raise QueryError(f"the query wants both '{other}' and '{path}': both cannot be inserted")
            values[path] = value
        base: Document = {}
        for path in sorted(values):
            _set_value(base, path, values[path])
        return self.apply(base, now).document


def _steps(name: str, fields: Any) -> Iterator[_UpdateStep]:
    if name not in _OPERATORS:
        raise needs_mongodb(f"{name} in an update")
    if not isinstance(fields, Mapping):
        raise QueryError(f"{name} takes a document of fields")
    for path, operand in fields.items():
        names = names_of_path(path)
        if not all(names):
            raise QueryError(f"{name}: '{path}' is not a path: a part of it is empty")
        if any(part == "$" or part.startswith("$[") for part in names):
            raise needs_mongodb(f"{name} of '{path}', with a positional operator,")
        if any(part.startswith("$") for part in names):
            raise QueryError(f"{name}: '{path}': fields of documents do not begin with a dollar")
        if name == "$inc" and not _is_number(operand):
            raise QueryError(f"$inc of '{path}' takes a number")
        if name == "$currentDate" and not isinstance(operand, bool):
            raise needs_mongodb(f"$currentDate of '{path}' with anything but true")
        if name == "$push" and has_operators(operand):
            raise needs_mongodb(f"$push of '{path}' with {next(iter(operand))}")
        yield _UpdateStep(name, path, operand)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)


def _apply_step(step: _UpdateStep, result: Changed, now: datetime) -> None:
    *parents, name = step.path.split(".")
    parent: Any = result.document
    for field_name in parents:
        parent = parent.get(field_name) if isinstance(parent, dict) else None
    old = parent.get(name, MISSING) if isinstance(parent, dict) else MISSING
    new = step.new_value(old, now)
    if new is MISSING:
        if old is not MISSING:
            del parent[name]
            result.removed.append(step.path)
    # a second change to the same time would look like no update on a virtual clock
    elif step.operator == "$currentDate" or old is MISSING or not same(old, new):
        _set_value(result.document, step.path, new)
        if step.operator == "$push" and len(new) > 1:
            # MongoDB's events have an appended element by its index
            result.fields[f"{step.path}.{len(new) - 1}"] = new[-1]
        else:
            result.fields[step.path] = new


def _set_value(document: Document, path: str, new: Any) -> None:
    """Set a value, creating documents on the path."""
    *parents, name = path.split(".")
    parent: Any = document
    for field_name in parents:
        parent = parent.setdefault(field_name, {})
        if not isinstance(parent, dict):
            raise QueryError(f"cannot set '{path}': '{field_name}' is not a document")
    parent[name] = new
