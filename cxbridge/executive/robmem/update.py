"""Updates of the embedded store: operators on dotted paths, compiled to functions.

Operators follow MongoDB's documentation. Unsupported operators are refused by name.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, NamedTuple

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.query import array_index, equalities, has_operators, needs_mongodb
from cxbridge.executive.robmem.values import MISSING, Document, copy, same

# the sort position of names, behind all indexes
_NAMES = sys.maxsize

Modify = Callable[[Any, datetime], Any]
"""Returns the new value for the old value and the time. Both values may be :data:`MISSING`."""


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
    modify: Modify


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
        _refuse_conflicts(steps)
        # as in MongoDB, new fields are added in the order of their names
        self._steps = sorted(steps, key=_place)

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
        wanted: dict[str, Any] = {}
        for path, value in equalities(query):
            for known in wanted:
                if path == known or path.startswith(f"{known}.") or known.startswith(f"{path}."):
                    raise QueryError(f"the query wants both '{known}' and '{path}': both cannot be inserted")
            wanted[path] = value
        base: Document = {}
        for path in sorted(wanted):
            _set_value(base, path.split("."), wanted[path], path)
        return self.apply(base, now).document


def _set(_path: str, operand: Any) -> Modify:
    return lambda _old, _now: operand


def _unset(_path: str, _operand: Any) -> Modify:
    return lambda _old, _now: MISSING


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)


def _inc(path: str, operand: Any) -> Modify:
    if not _is_number(operand):
        raise QueryError(f"$inc of '{path}' takes a number")

    def modify(old: Any, _now: datetime) -> Any:
        if old is MISSING:
            return operand
        if not _is_number(old):
            raise QueryError(f"$inc: '{path}' is not a number")
        result = old + operand
        if isinstance(result, int) and not -(2**63) <= result < 2**63:
            raise QueryError(f"$inc: '{path}' would be {result}, more than an integer can hold")
        return result

    return modify


def _push(path: str, operand: Any) -> Modify:
    if has_operators(operand):
        raise needs_mongodb(f"$push of '{path}' with {next(iter(operand))}")

    def modify(old: Any, _now: datetime) -> Any:
        if old is MISSING:
            return [operand]
        if not isinstance(old, list):
            raise QueryError(f"$push: '{path}' is not an array")
        return [*old, operand]

    return modify


def _current_date(path: str, operand: Any) -> Modify:
    if not isinstance(operand, bool):
        raise needs_mongodb(f"$currentDate of '{path}' with anything but true")
    return lambda _old, now: now


_OPERATORS: dict[str, Callable[[str, Any], Modify]] = {
    "$set": _set,
    "$unset": _unset,
    "$inc": _inc,
    "$push": _push,
    "$currentDate": _current_date,
}


def _steps(name: str, fields: Any) -> Iterator[_UpdateStep]:
    if name not in _OPERATORS:
        raise needs_mongodb(f"{name} in an update")
    if not isinstance(fields, Mapping):
        raise QueryError(f"{name} takes a document of fields")
    for path, operand in fields.items():
        parts = path.split(".")
        if not all(parts):
            raise QueryError(f"{name}: '{path}' is not a path: a part of it is empty")
        if any(part == "$" or part.startswith("$[") for part in parts):
            raise needs_mongodb(f"{name} of '{path}', with a positional operator,")
        if any(part.startswith("$") for part in parts):
            raise QueryError(f"{name}: '{path}': fields of documents do not begin with a dollar")
        yield _UpdateStep(name, path, _OPERATORS[name](path, operand))


def _refuse_conflicts(steps: list[_UpdateStep]) -> None:
    """Raise if the paths of two steps are equal or contain each other."""
    ends: set[str] = set()
    ways: set[str] = set()
    for step in steps:
        parts = step.path.split(".")
        prefixes = {".".join(parts[:count]) for count in range(1, len(parts) + 1)}
        if conflict := min(prefixes & ends, default=step.path if step.path in ways else ""):
            raise QueryError(f"updating the path '{step.path}' would create a conflict at '{conflict}'")
        ends.add(step.path)
        ways |= prefixes


def _place(step: _UpdateStep) -> list[tuple[int, str]]:
    """Return a sort key for steps: indexes as numbers, names as text."""
    indexes = [(part, array_index(part)) for part in step.path.split(".")]
    return [(_NAMES, part) if index is None else (index, "") for part, index in indexes]


def _apply_step(step: _UpdateStep, result: Changed, now: datetime) -> None:
    parts = step.path.split(".")
    old = _get(result.document, parts)
    new = step.modify(old, now)
    if new is MISSING:
        if old is not MISSING:
            _remove(result, parts, step.path)
        return
    if step.operator != "$currentDate" and old is not MISSING and same(old, new):
        return  # a second change to the same time would look like no update on a virtual clock
    _set_value(result.document, parts, new, step.path)
    if step.operator == "$push" and len(new) > 1:
        result.fields[f"{step.path}.{len(new) - 1}"] = new[-1]
    else:
        result.fields[step.path] = new


def _get(value: Any, parts: list[str]) -> Any:
    for part in parts:
        if isinstance(value, dict):
            value = value.get(part, MISSING)
        elif isinstance(value, list) and (index := array_index(part)) is not None and index < len(value):
            value = value[index]
        else:
            return MISSING
    return value


def _set_value(document: Document, parts: list[str], new: Any, path: str) -> None:
    """Set a value, creating documents on the path."""
    at: Any = document
    for part, is_last in zip(parts, [*[False] * (len(parts) - 1), True], strict=True):
        place: Any = part
        if isinstance(at, list):
            place = array_index(part)
            if place is None:
                raise QueryError(f"cannot set '{path}': '{part}' is no element of the array")
            if place > len(at):
                raise needs_mongodb(f"setting '{path}' behind the end of the array")
            if place == len(at):
                at.append({})
        elif isinstance(at, dict):
            at.setdefault(part, {})
        else:
            raise QueryError(f"cannot set '{path}': '{part}' is below a single value")
        if is_last:
            at[place] = new
        at = at[place]


def _remove(result: Changed, parts: list[str], path: str) -> None:
    """Remove a value. An element of an array becomes null, so that later elements keep their indexes."""
    at = _get(result.document, parts[:-1])
    if isinstance(at, dict):
        del at[parts[-1]]
        result.removed.append(path)
    elif at[int(parts[-1])] is not None:
        at[int(parts[-1])] = None
        result.fields[path] = None
