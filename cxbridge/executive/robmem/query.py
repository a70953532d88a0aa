"""Queries: compiled once, then asked of documents.

What there is: equality, ``$eq $ne $gt $gte $lt $lte $in $nin $exists $type $regex $options $not $size $all
$elemMatch $mod`` on paths with dots, ``$and $or $nor`` around. Anything else is an error, not a silent miss.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from bson import Regex

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import MISSING, Document, key, rank, type_name, values_at

Test = Callable[[Any], bool]
"""Asks something of a value, or of a document."""

_FLAGS = {"i": re.IGNORECASE, "m": re.MULTILINE, "s": re.DOTALL, "x": re.VERBOSE}
_TYPE_NUMBERS = {
    1: "double",
    2: "string",
    3: "object",
    4: "array",
    5: "binData",
    7: "objectId",
    8: "bool",
    9: "date",
    10: "null",
    11: "regex",
    16: "int",
    17: "timestamp",
    18: "long",
}


def compile_query(query: Mapping[str, Any]) -> Callable[[Document], bool]:
    """Return what tells of a document whether it fits the query.

    :raises QueryError: when the query is not one.
    """
    tests = [_part(name, wanted) for name, wanted in query.items()]
    if len(tests) == 1:
        return tests[0]
    return lambda document: all(test(document) for test in tests)


def equalities(query: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield path and value of what the query wants equal in any case: for indexes and for upserts."""
    for name, wanted in query.items():
        if name == "$and" and isinstance(wanted, list):
            for part in wanted:
                if isinstance(part, Mapping):
                    yield from equalities(part)
        elif name.startswith("$"):
            continue
        elif not _has_operators(wanted):
            if not isinstance(wanted, Regex | re.Pattern):
                yield name, wanted
        elif "$eq" in wanted:
            yield name, wanted["$eq"]


def _has_operators(wanted: Any) -> bool:
    return isinstance(wanted, Mapping) and next(iter(wanted), "").startswith("$")


def _part(name: str, wanted: Any) -> Callable[[Document], bool]:
    if name in ("$and", "$or", "$nor"):
        return _several(name, wanted)
    if name.startswith("$"):
        if name == "$comment":
            return lambda _document: True
        raise QueryError(f"queries cannot have '{name}' here", hint="known are $and, $or, $nor and fields")
    return _on_path(name, _condition(wanted))


def _several(name: str, wanted: Any) -> Callable[[Document], bool]:
    if not isinstance(wanted, list) or not wanted or not all(isinstance(part, Mapping) for part in wanted):
        raise QueryError(f"{name} takes an array of queries, one at least")
    parts = [compile_query(part) for part in wanted]
    if name == "$and":
        return lambda document: all(part(document) for part in parts)
    if name == "$or":
        return lambda document: any(part(document) for part in parts)
    return lambda document: not any(part(document) for part in parts)


def _on_path(path: str, test: Callable[[list[Any]], bool]) -> Callable[[Document], bool]:
    return lambda document: test(list(values_at(document, path)))


# A condition is asked of all values that a path leads to. Most are fulfilled when one value does, be it an
# element of an array; their contraries when none does.


def _condition(wanted: Any) -> Callable[[list[Any]], bool]:
    if not _has_operators(wanted):
        if isinstance(wanted, Regex | re.Pattern):
            return _any(_regex(wanted, None))
        return _any(_equals(wanted))
    parts = [
        _operator(name, operand, wanted)
        for name, operand in wanted.items()
        if not (name == "$options" and "$regex" in wanted)
    ]
    return lambda values: all(part(values) for part in parts)


def _any(test: Test) -> Callable[[list[Any]], bool]:
    def of_values(values: list[Any]) -> bool:
        for value in values:
            if test(value) or (isinstance(value, list) and any(test(item) for item in value)):
                return True
        return False

    return of_values


def _not(condition: Callable[[list[Any]], bool]) -> Callable[[list[Any]], bool]:
    return lambda values: not condition(values)


def _equals(wanted: Any) -> Test:
    target = key(wanted)
    return lambda value: key(value) == target


def _operator(name: str, operand: Any, whole: Mapping[str, Any]) -> Callable[[list[Any]], bool]:
    contrary = {"$ne": "$eq", "$nin": "$in"}.get(name)
    if contrary is not None:
        return _not(_operator(contrary, operand, whole))
    match name:
        case "$eq":
            return _any(_equals(operand))
        case "$gt" | "$gte" | "$lt" | "$lte":
            return _any(_compares(name, operand))
        case "$regex":
            return _any(_regex(operand, whole.get("$options")))
        case "$not":
            if not _has_operators(operand) and not isinstance(operand, Regex | re.Pattern):
                raise QueryError("$not takes operators or a regular expression")
            return _not(_condition(operand))
    return _rare(name, operand)


def _rare(name: str, operand: Any) -> Callable[[list[Any]], bool]:
    match name:
        case "$in":
            return _one_of(operand)
        case "$exists":
            wanted = bool(operand)
            return lambda values: any(value is not MISSING for value in values) == wanted
        case "$type":
            return _any(_of_type(operand))
        case "$mod":
            return _any(_modulo(operand))
    return _on_arrays(name, operand)


def _on_arrays(name: str, operand: Any) -> Callable[[list[Any]], bool]:
    match name:
        case "$size":
            return lambda values: any(isinstance(value, list) and len(value) == operand for value in values)
        case "$all":
            if not isinstance(operand, list):
                raise QueryError("$all takes an array")
            parts = [_condition(item) for item in operand]
            return lambda values: bool(parts) and all(part(values) for part in parts)
        case "$elemMatch":
            if not isinstance(operand, Mapping):
                raise QueryError("$elemMatch takes a query")
            test = _of_element(operand)
            return lambda values: any(isinstance(v, list) and any(test(item) for item in v) for v in values)
    raise QueryError(f"there is no operator '{name}' in queries here", hint="see docs/robot-memory.md")


def _of_element(operand: Mapping[str, Any]) -> Test:
    if _has_operators(operand) and next(iter(operand)) not in ("$and", "$or", "$nor"):
        condition = _condition(operand)
        return lambda item: condition([item])
    query = compile_query(operand)
    return lambda item: isinstance(item, dict) and query(item)


def _compares(name: str, operand: Any) -> Test:
    """Compare with a value; only values of its type fit."""
    target, place = key(operand), rank(operand)
    if name == "$gt":
        return lambda value: value is not MISSING and rank(value) == place and key(value) > target
    if name == "$gte":
        return lambda value: rank(value) == place and key(value) >= target
    if name == "$lt":
        return lambda value: value is not MISSING and rank(value) == place and key(value) < target
    return lambda value: rank(value) == place and key(value) <= target


def _one_of(operand: Any) -> Callable[[list[Any]], bool]:
    if not isinstance(operand, list):
        raise QueryError("$in and $nin take an array")
    patterns = [_regex(item, None) for item in operand if isinstance(item, Regex | re.Pattern)]
    targets = {key(item) for item in operand if not isinstance(item, Regex | re.Pattern)}
    return _any(lambda value: key(value) in targets or any(pattern(value) for pattern in patterns))


def _regex(pattern: Any, options: Any) -> Test:
    flags = 0
    if isinstance(pattern, Regex | re.Pattern):
        flags, pattern = pattern.flags & ~re.UNICODE, pattern.pattern
    for letter in options or "":
        if letter not in _FLAGS:
            raise QueryError(f"regular expressions have no option '{letter}'", hint="known are i, m, s and x")
        flags |= _FLAGS[letter]
    if not isinstance(pattern, str):
        raise QueryError("$regex takes a text or a regular expression")
    try:
        compiled = re.compile(pattern, flags)
    except re.error as error:
        raise QueryError(f"not a regular expression: {pattern}: {error}") from None
    return lambda value: isinstance(value, str) and compiled.search(value) is not None


def _of_type(operand: Any) -> Test:
    wanted = {_TYPE_NUMBERS.get(item, item) for item in (operand if isinstance(operand, list) else [operand])}

    def test(value: Any) -> bool:
        if value is MISSING:
            return False
        name = type_name(value)
        if name != "number":
            return name in wanted
        exact = "double" if isinstance(value, float) else "long" if type(value) is not int else "int"
        return bool({"number", exact} & wanted)

    return test


def _modulo(operand: Any) -> Test:
    if not isinstance(operand, list) or len(operand) != 2 or not operand[0]:  # noqa: PLR2004
        raise QueryError("$mod takes [divisor, remainder], the divisor not 0")
    divisor, remainder = operand
    return lambda value: (
        isinstance(value, int | float) and not isinstance(value, bool) and (value % divisor == remainder)
    )
