"""Updates: ``$set $setOnInsert $unset $inc $push $currentDate``, on paths with dots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from bson import ObjectId

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.query import equalities
from cxbridge.executive.robmem.values import MISSING, Document, copy, encode, equal

_OPERATORS = ("$set", "$setOnInsert", "$unset", "$inc", "$push", "$currentDate")


@dataclass
class Changed:
    """What an update did to a document.

    :param document: how it is now; the one before is as it was.
    :param fields: new values by path.
    :param removed: the paths that are gone.
    """

    document: Document
    fields: Document = field(default_factory=dict)
    removed: list[str] = field(default_factory=list)

    @property
    def anything(self) -> bool:
        """Whether the document is another one now."""
        return bool(self.fields or self.removed)


def operators(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return an update as operators: plain fields become ``$set``.

    :raises QueryError: when operators and fields are mixed, or an operator is not known.
    """
    names = list(changes)
    if not any(name.startswith("$") for name in names):
        return {"$set": dict(changes)}
    for name in names:
        if name not in _OPERATORS:
            raise QueryError(
                f"there is no operator '{name}' in updates here", hint=f"known are {', '.join(_OPERATORS)}"
            )
        if not isinstance(changes[name], Mapping):
            raise QueryError(f"{name} takes a document of fields")
    return dict(changes)


def apply(
    document: Document, changes: Mapping[str, Any], now: datetime, *, inserting: bool = False
) -> Changed:
    """Apply operators to a copy of a document.

    :raises QueryError: when they do not fit it.
    """
    result = Changed(copy(document))
    for name, fields in changes.items():
        for path, operand in fields.items():
            _check_path(name, path)
            if name == "$unset":
                if _remove(result.document, path.split(".")):
                    result.removed.append(path)
            elif name != "$setOnInsert" or inserting:
                new, counts = _new_value(name, path, operand, _get(result.document, path.split(".")), now)
                if counts or not _same(_get(document, path.split(".")), new):
                    result.fields[path] = new
                _put(result.document, path.split("."), new, path)
    if "_id" in document and not equal(document["_id"], result.document.get("_id", MISSING)):
        raise QueryError("an update cannot change the '_id' of a document")
    return result


def new_document(query: Mapping[str, Any], changes: Mapping[str, Any], now: datetime) -> Document:
    """Return what an upsert inserts: what the query wants equal, then the update."""
    base: Document = {}
    for path, wanted in equalities(query):
        _put(base, path.split("."), wanted, path)
    return apply(base, changes, now, inserting=True).document


def _check_path(name: str, path: str) -> None:
    parts = path.split(".")
    if not all(parts):
        raise QueryError(f"{name}: '{path}' is no path: a part of it is empty")
    if parts[0].startswith("$") or "$" in parts:
        raise QueryError(f"{name}: '{path}': fields of documents do not begin with a dollar")


def _new_value(name: str, path: str, operand: Any, old: Any, now: datetime) -> tuple[Any, bool]:
    """Return a field's new value, and whether it counts as new even if it is the same."""
    if name == "$currentDate":
        # each is a moment of its own, also where a virtual clock stands still
        return now, True
    if name == "$inc":
        if isinstance(operand, bool) or not isinstance(operand, int | float):
            raise QueryError(f"$inc of '{path}' takes a number")
        if old is MISSING:
            return operand, True
        if isinstance(old, bool) or not isinstance(old, int | float):
            raise QueryError(f"$inc: '{path}' is no number")
        return old + operand, operand != 0
    if name == "$push":
        before = [] if old is MISSING else old
        if not isinstance(before, list):
            raise QueryError(f"$push: '{path}' is no array")
        each = isinstance(operand, Mapping) and "$each" in operand
        return [*before, *(operand["$each"] if each else [operand])], True
    return operand, old is MISSING


def _same(old: Any, new: Any) -> bool:
    """Whether a value stays as it is, to the byte: 1 and 1.0 are equal, but not the same."""
    return old is not MISSING and encode({"": old}) == encode({"": new})


def _get(value: Any, parts: list[str]) -> Any:
    for part in parts:
        if isinstance(value, dict) and part in value:
            value = value[part]
        elif isinstance(value, list) and part.isdigit() and int(part) < len(value):
            value = value[int(part)]
        else:
            return MISSING
    return value


def _put(document: Document, parts: list[str], new: Any, path: str) -> None:
    at: Any = document
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        if isinstance(at, list):
            if not part.isdigit() or int(part) >= len(at):
                raise QueryError(f"cannot set '{path}': '{part}' is no element of the array")
            index: Any = int(part)
        elif isinstance(at, dict):
            index = part
        else:
            raise QueryError(f"cannot set '{path}': '{part}' would be below a single value")
        if following is None:
            at[index] = new
        else:
            at = at.setdefault(index, {}) if isinstance(at, dict) else at[index]


def _remove(document: Document, parts: list[str]) -> bool:
    at = _get(document, parts[:-1]) if len(parts) > 1 else document
    return isinstance(at, dict) and at.pop(parts[-1], MISSING) is not MISSING


def with_id(document: Mapping[str, Any], make: ObjectId) -> Document:
    """Return the document with its `_id` first; ``make`` when it has none."""
    identity = document.get("_id", make)
    return {"_id": identity, **{name: value for name, value in document.items() if name != "_id"}}
