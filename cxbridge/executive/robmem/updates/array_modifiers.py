"""The update operators on arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from bson import Regex

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.conditions import has_operators, whole_number
from cxbridge.executive.robmem.queries.query import LOGICAL, compile_query
from cxbridge.executive.robmem.queries.sorting import order_of, sort_values
from cxbridge.executive.robmem.updates.modifiers import KEEP, Modify, UpdateMoment
from cxbridge.executive.robmem.values import MISSING, key

_CLAUSES = ("$each", "$slice", "$sort", "$position")


class Appended(list[Any]):
    """An array that got elements at its end, and nothing else.

    :param added: they.
    """

    def __init__(self, old: list[Any], added: list[Any]) -> None:
        super().__init__([*old, *added])
        self.added = len(added)


def _old_array(name: str, path: str, old: Any) -> list[Any]:
    if not isinstance(old, list):
        raise QueryError(f"{name}: '{path}' is not an array")
    return old


def _each(name: str, path: str, operand: Any) -> list[Any]:
    """Return the values to add."""
    if not isinstance(operand, Mapping) or "$each" not in operand:
        if has_operators(operand):
            raise QueryError(f"{name} of '{path}': '{next(iter(operand))}' goes with $each")
        return [operand]
    clauses = _CLAUSES if name == "$push" else _CLAUSES[:1]
    for clause in operand:
        if clause not in clauses:
            raise QueryError(
                f"{name} of '{path}' knows no '{clause}'", hint=f"known are {', '.join(clauses)}"
            )
    if not isinstance(operand["$each"], list):
        raise QueryError(f"{name} of '{path}': $each takes an array")
    return operand["$each"]


def _push(path: str, operand: Any) -> Modify:
    added = _each("$push", path, operand)
    clauses = operand if isinstance(operand, Mapping) and "$each" in operand else {}
    position, slice_ = (
        _clause(path, name, clauses[name]) if name in clauses else None for name in ("$position", "$slice")
    )
    sort = clauses.get("$sort", MISSING)
    order = None if sort is MISSING else order_of(sort if isinstance(sort, Mapping) else {"": sort}, "$push")

    def modify(old: Any, _moment: UpdateMoment) -> Any:
        before = [] if old is MISSING else _old_array("$push", path, old)
        if position is None and order is None and slice_ is None:
            return Appended(before, added)
        at = len(before) if position is None else position
        new = [*before[:at], *added, *before[at:]]
        if order is not None:
            new = sort_values(new, order, whole=not isinstance(sort, Mapping))
        if slice_ is not None:
            new = new[:slice_] if slice_ >= 0 else new[slice_:]
        return new

    return modify


def _clause(path: str, name: str, value: Any) -> int:
    number = whole_number(value)
    if number is None:
        raise QueryError(f"$push of '{path}': {name} takes a whole number")
    return number


def _add_to_set(path: str, operand: Any) -> Modify:
    wanted = _each("$addToSet", path, operand)

    def modify(old: Any, _moment: UpdateMoment) -> Any:
        before = [] if old is MISSING else _old_array("$addToSet", path, old)
        known = set(map(key, before))
        added = []
        for value in wanted:
            if key(value) not in known:
                known.add(key(value))
                added.append(value)
        return Appended(before, added)

    return modify


def _pop(path: str, operand: Any) -> Modify:
    end = whole_number(operand)
    if end not in (1, -1):
        raise QueryError(f"$pop of '{path}' takes 1 for the last or -1 for the first element")

    def modify(old: Any, _moment: UpdateMoment) -> Any:
        if old is MISSING:
            return KEEP
        items = _old_array("$pop", path, old)
        return items[:-1] if end == 1 else items[1:]

    return modify


def _removing(name: str, path: str, fits: Callable[[Any], bool]) -> Modify:
    def modify(old: Any, _moment: UpdateMoment) -> Any:
        if old is MISSING:
            return KEEP
        return [item for item in _old_array(name, path, old) if not fits(item)]

    return modify


def _pull(path: str, operand: Any) -> Modify:
    if isinstance(operand, Regex) or (has_operators(operand) and next(iter(operand)) not in LOGICAL):
        condition = compile_query({"": operand})
        return _removing("$pull", path, lambda item: condition({"": item}))
    if isinstance(operand, Mapping):
        query = compile_query(operand)
        return _removing("$pull", path, lambda item: isinstance(item, dict) and query(item))
    target = key(operand)
    return _removing("$pull", path, lambda item: key(item) == target)


def _pull_all(path: str, operand: Any) -> Modify:
    if not isinstance(operand, list):
        raise QueryError(f"$pullAll of '{path}' takes an array")
    targets = set(map(key, operand))
    return _removing("$pullAll", path, lambda item: key(item) in targets)


ARRAY_OPERATORS: dict[str, Callable[[str, Any], Modify]] = {
    "$push": _push,
    "$addToSet": _add_to_set,
    "$pop": _pop,
    "$pull": _pull,
    "$pullAll": _pull_all,
}
"""By name, what makes of a path and an operand what modifies a value."""
