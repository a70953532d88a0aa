"""Updates: operators on paths with dots, compiled once, then applied to documents.

What an operator makes of one value is in `modifiers` and, for arrays, in `array_modifiers`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, NamedTuple

from bson import ObjectId

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.paths import array_index
from cxbridge.executive.robmem.queries.query import equalities
from cxbridge.executive.robmem.updates.array_modifiers import ARRAY_OPERATORS, Appended
from cxbridge.executive.robmem.updates.modifiers import KEEP, OPERATORS, Modify, UpdateMoment
from cxbridge.executive.robmem.values import MISSING, Document, copy, same

_KNOWN = {**OPERATORS, **ARRAY_OPERATORS}
_SPECIAL = ("$rename", "$setOnInsert")
_MOST_PADDING = 1_500_000
"""Nulls that an index far behind the end of an array may ask for."""

_NAMES = sys.maxsize
"""Where names stand among indexes: behind them."""


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


class _UpdateStep(NamedTuple):
    """What one operator does at one path.

    :param modify: makes the new value of the old one.
    :param source: of ``$rename``: where the value comes from.
    :param only_inserting: whether it is done only in a document that is inserted.
    """

    operator: str
    path: str
    modify: Modify
    source: str = ""
    only_inserting: bool = False


def as_operators(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return an update as operators: plain fields become ``$set``."""
    if any(name.startswith("$") for name in changes):
        return dict(changes)
    return {"$set": dict(changes)}


class Update:
    """An update.

    :param changes: operators, or plain fields, which are set.
    :raises QueryError: when an operator is not known, its operand is none of its, or paths conflict.
    """

    def __init__(self, changes: Mapping[str, Any]) -> None:
        steps = [step for name, fields in as_operators(changes).items() for step in _steps(name, fields)]
        # new fields come in the order of their names, whatever the order of the update is
        if len({step.path for step in steps}) == len(steps) and all(map(_is_simple, steps)):
            self._steps = sorted(steps, key=attrgetter("path"))  # most are of this kind
            return
        _refuse_conflicts(steps)
        self._steps = sorted(steps, key=_place)

    def apply(self, document: Document, moment: UpdateMoment, *, inserting: bool = False) -> Changed:
        """Apply the update to a copy of a document.

        :raises QueryError: when the document does not fit it.
        """
        result = Changed(copy(document))
        for step in self._steps:
            if inserting or not step.only_inserting:
                _take(step, result, moment)
        if "_id" in document and not same(document["_id"], result.document.get("_id", MISSING)):
            raise QueryError("an update cannot change the '_id' of a document")
        return result

    def new_document(self, query: Mapping[str, Any], moment: UpdateMoment) -> Document:
        """Return what an upsert inserts: what the query wants equal, then the update.

        :raises QueryError: when the query wants two values at one place.
        """
        wanted: dict[str, Any] = {}
        for path, value in equalities(query):
            for known in wanted:
                if _is_within(path, known) or _is_within(known, path):
                    raise QueryError(
                        f"the query wants both '{known}' and '{path}': the document to insert is ambiguous"
                    )
            wanted[path] = value
        base: Document = {}
        for path in sorted(wanted):
            _put(base, path.split("."), wanted[path], path)
        return self.apply(base, moment, inserting=True).document


# --- reading an update ------------------------------------------------------------------------------------


def _steps(name: str, fields: Any) -> Iterator[_UpdateStep]:
    if name not in _KNOWN and name not in _SPECIAL:
        known = ", ".join(sorted((*_KNOWN, *_SPECIAL)))
        raise QueryError(f"there is no operator '{name}' in updates here", hint=f"known are {known}")
    if not isinstance(fields, Mapping):
        raise QueryError(f"{name} takes a document of fields")
    for path, operand in fields.items():
        _check_path(name, path)
        if name == "$rename":
            if not isinstance(operand, str):
                raise QueryError(f"$rename of '{path}' takes the new path as text")
            _check_path(name, operand)
            yield _UpdateStep(name, operand, lambda _old, _moment: KEEP, source=path)
        elif name == "$setOnInsert":
            yield _UpdateStep(name, path, OPERATORS["$set"](path, operand), only_inserting=True)
        else:
            yield _UpdateStep(name, path, _KNOWN[name](path, operand))


def _check_path(name: str, path: str) -> None:
    if path.isidentifier():
        return  # most are
    parts = path.split(".")
    if not all(parts):
        raise QueryError(f"{name}: '{path}' is not a path: a part of it is empty")
    for number, part in enumerate(parts):
        if part == "$" or part.startswith("$["):
            raise QueryError(
                f"{name}: '{path}': there is no positional operator '{part}' here",
                hint="name the element by its index, or set the whole array",
            )
        if part.startswith("$") and (number == 0 or part not in ("$ref", "$id", "$db")):
            raise QueryError(f"{name}: '{path}': fields of documents do not begin with a dollar")


def _is_simple(step: _UpdateStep) -> bool:
    """Whether a step changes one field of the document itself."""
    return step.path.isidentifier() and not step.source


def _is_within(path: str, other: str) -> bool:
    """Whether a path is another one, or leads on from it."""
    return path == other or path.startswith(f"{other}.")


def _refuse_conflicts(steps: list[_UpdateStep]) -> None:
    """Raise an error when two steps change the same place, or one a place within another's."""
    paths = [path for step in steps for path in (step.source, step.path) if path]
    ends: set[str] = set()
    ways: set[str] = set()
    for path in paths:
        parts = path.split(".")
        prefixes = {".".join(parts[:count]) for count in range(1, len(parts) + 1)}
        if conflict := min(prefixes & ends, default=path if path in ways else ""):
            raise QueryError(f"updating the path '{path}' would create a conflict at '{conflict}'")
        ends.add(path)
        ways |= prefixes


def _place(step: _UpdateStep) -> list[tuple[int, str]]:
    """Return where a step comes among others: indexes as numbers, names as text."""
    indexes = [(part, array_index(part)) for part in step.path.split(".")]
    return [(_NAMES, part) if index is None else (index, "") for part, index in indexes]


# --- applying it ------------------------------------------------------------------------------------------


def _take(step: _UpdateStep, result: Changed, moment: UpdateMoment) -> None:
    """Do one step, and note what it changes."""
    if step.source:
        _rename(step, result)
        return
    document, path = result.document, step.path
    parts = path.split(".") if "." in path else [path]
    old = _get(document, parts)
    new = step.modify(old, moment)
    if new is KEEP or (new is old and new is MISSING):
        if old is MISSING and step.operator != "$unset":
            _check_way(document, parts, step.path)
        return
    if new is MISSING:
        _remove(result, parts, step.path)
        return
    appended = new.added if isinstance(new, Appended) else 0
    new = list(new) if isinstance(new, Appended) else new
    if step.operator != "$currentDate" and old is not MISSING and same(old, new):
        return  # each moment is one of its own, also where a virtual clock stands still
    _put(document, parts, new, step.path)
    if appended and appended < len(new):
        for index in range(len(new) - appended, len(new)):
            result.fields[f"{step.path}.{index}"] = new[index]
    else:
        result.fields[step.path] = new


def _rename(step: _UpdateStep, result: Changed) -> None:
    source, target = step.source.split("."), step.path.split(".")
    for parts, path in ((source, step.source), (target, step.path)):
        at: Any = result.document
        for part in parts[:-1]:
            at = at.get(part, MISSING) if isinstance(at, dict) else MISSING
            if isinstance(at, list):
                raise QueryError(f"$rename: '{path}' goes through an array")
    value = _get(result.document, source)
    if value is MISSING:
        _check_way(result.document, source, step.source)
        return
    _remove(result, source, step.source)
    if not same(_get(result.document, target), value):
        _put(result.document, target, value, step.path)
        result.fields[step.path] = value


def _get(value: Any, parts: list[str]) -> Any:
    for part in parts:
        if isinstance(value, dict):
            value = value.get(part, MISSING)
        elif isinstance(value, list) and (index := array_index(part)) is not None and index < len(value):
            value = value[index]
        else:
            return MISSING
    return value


def _check_way(document: Document, parts: list[str], path: str) -> None:
    """Raise an error when a path that leads nowhere could not be made either."""
    at: Any = document
    for part in parts:
        if at is MISSING:
            return
        if isinstance(at, dict):
            at = at.get(part, MISSING)
        elif isinstance(at, list) and (index := array_index(part)) is not None:
            at = at[index] if index < len(at) else MISSING
        else:
            kind = "no element of the array" if isinstance(at, list) else "below a single value"
            raise QueryError(f"cannot set '{path}': '{part}' is {kind}")


def _put(document: Document, parts: list[str], new: Any, path: str) -> None:
    if len(parts) == 1:
        document[parts[0]] = new
        return
    _check_way(document, parts, path)
    at: Any = document
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        index: Any = part
        if isinstance(at, list):
            index = int(part)
            if index - len(at) > _MOST_PADDING:
                raise QueryError(f"cannot set '{path}': '{part}' is far behind the end of the array")
            if index >= len(at):
                at += [None] * (index - len(at)) + [{}]
        if following is None:
            at[index] = new
        else:
            at = at.setdefault(index, {}) if isinstance(at, dict) else at[index]


def _remove(result: Changed, parts: list[str], path: str) -> None:
    """Take a value away; an element of an array becomes null, so that the others keep their places."""
    at = _get(result.document, parts[:-1])
    if isinstance(at, dict):
        del at[parts[-1]]
        result.removed.append(path)
    elif at[int(parts[-1])] is not None:
        at[int(parts[-1])] = None
        result.fields[path] = None


def with_id(document: Mapping[str, Any], make: ObjectId) -> Document:
    """Return the document with its `_id` first; ``make`` when it has none."""
    identity = document.get("_id", make)
    return {"_id": identity, **{name: value for name, value in document.items() if name != "_id"}}
