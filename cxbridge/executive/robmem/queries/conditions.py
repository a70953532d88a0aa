"""The conditions of a query on one field, or on one element of an array: comparisons and their like."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any

from bson import Decimal128, MaxKey, MinKey, Regex

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries import paths
from cxbridge.executive.robmem.queries.regexes import compile_regex, letters
from cxbridge.executive.robmem.values import MISSING, NAN, key, type_name

Test = Callable[[Any], bool]
"""Asks something of a value, or of a document."""

TYPE_NUMBERS = {
    -1: "minKey",
    1: "double",
    2: "string",
    3: "object",
    4: "array",
    5: "binData",
    6: "undefined",
    7: "objectId",
    8: "bool",
    9: "date",
    10: "null",
    11: "regex",
    12: "dbPointer",
    13: "javascript",
    14: "symbol",
    15: "javascriptWithScope",
    16: "int",
    17: "timestamp",
    18: "long",
    19: "decimal",
    127: "maxKey",
}
_NUMBER_TYPES = {"int", "long", "double", "decimal"}


Place = str | None
"""Where a condition finds what it asks: the path in a document; None for an element of an array itself."""


def has_operators(wanted: Any) -> bool:
    """Whether a document is one of operators; the first field decides."""
    return isinstance(wanted, Mapping) and next(iter(wanted), "").startswith("$")


def compile_condition(place: Place, wanted: Any, elements: Callable[[Any], Test]) -> Test:
    """Return what says for a document, or of an element, whether it fits.

    :param wanted: a value to be equal to, a regular expression, or operators.
    :param elements: compiles what ``$elemMatch`` wants.
    :raises QueryError: when an operator is not known, or its operand is none of its.
    """
    if not has_operators(wanted):
        test = _pattern(wanted) if isinstance(wanted, Regex) else _equals(wanted)
        return _any(place, test)
    parts = [
        _operator(place, name, operand, wanted, elements)
        for name, operand in wanted.items()
        if not (name == "$options" and "$regex" in wanted)
    ]
    if len(parts) == 1:
        return parts[0]
    return lambda subject: all(part(subject) for part in parts)


def _any(place: Place, test: Test) -> Test:
    if place is None:
        return test
    leaves = paths.leaves(place)
    return lambda subject: any(map(test, leaves(subject)))


def _not(condition: Test) -> Test:
    return lambda subject: not condition(subject)


def _operator(
    place: Place, name: str, operand: Any, whole: Mapping[str, Any], elements: Callable[[Any], Test]
) -> Test:
    match name:
        case "$ne" | "$nin" | "$not" | "$exists":
            return _maybe_not(place, name, operand, elements)
        case "$size" | "$elemMatch":
            return _of_array(place, name, operand, elements)
        case "$all":
            return _all(place, operand, elements)
        case "$regex":
            return _any(place, _regex(operand, whole.get("$options")))
    return _any(place, _of_value(name, operand))


def _maybe_not(place: Place, name: str, operand: Any, elements: Callable[[Any], Test]) -> Test:
    """Return the test of an operator that is the contrary of another, or can be."""
    if name == "$exists":
        test = _any(place, lambda value: value is not MISSING)
        return _not(test) if operand is None or key(operand) in (key(0), key(value=False)) else test
    if name == "$ne":
        _refuse_regex(name, operand)
        return _not(_any(place, _equals(operand)))
    if name == "$nin":
        return _not(_any(place, _one_of(operand)))
    if not has_operators(operand) and not isinstance(operand, Regex):
        raise QueryError("$not takes operators or a regular expression")
    return _not(compile_condition(place, operand, elements))


def _of_value(name: str, operand: Any) -> Test:
    """Return the test of an operator that one value decides."""
    match name:
        case "$eq":
            return _equals(operand)
        case "$gt" | "$gte" | "$lt" | "$lte":
            return _compares(name, operand)
        case "$in":
            return _one_of(operand)
        case "$type":
            return _of_type(operand)
        case "$mod":
            return _modulo(operand)
    raise QueryError(f"there is no operator '{name}' in queries here", hint="see docs/robot-memory.md")


# --- arrays -----------------------------------------------------------------------------------------------


def _of_array(place: Place, name: str, operand: Any, elements: Callable[[Any], Test]) -> Test:
    values = paths.values(place) if place is not None else lambda element: (element,)
    if name == "$size":
        size = whole_number(operand)
        if size is None or size < 0:
            raise QueryError("$size takes a whole number, 0 or more")
        return lambda subject: any(isinstance(v, list) and len(v) == size for v in values(subject))
    if not isinstance(operand, Mapping):
        raise QueryError("$elemMatch takes a query")
    fits = elements(operand)
    return lambda subject: any(isinstance(v, list) and any(map(fits, v)) for v in values(subject))


def _all(place: Place, operand: Any, elements: Callable[[Any], Test]) -> Test:
    if not isinstance(operand, list):
        raise QueryError("$all takes an array")
    matches = [has_operators(item) and [*item] == ["$elemMatch"] for item in operand]
    if any(matches) and not all(matches):
        raise QueryError("$all takes values, or $elemMatch in each element")
    if any(has_operators(item) and not match for item, match in zip(operand, matches, strict=True)):
        raise QueryError("$all takes no operators but $elemMatch")
    parts = [compile_condition(place, item, elements) for item in operand]
    return lambda subject: bool(parts) and all(part(subject) for part in parts)


# --- single values ----------------------------------------------------------------------------------------


def _equals(wanted: Any) -> Test:
    target = key(wanted)
    return lambda value: key(value) == target


def _refuse_regex(name: str, operand: Any) -> None:
    if isinstance(operand, Regex):
        raise QueryError(f"{name} takes no regular expression")


def _compares(name: str, operand: Any) -> Test:
    """Compare with a value; only values of its type fit."""
    _refuse_regex(name, operand)
    target = key(operand)
    place = target[0]
    if isinstance(operand, MinKey | MaxKey):
        # these are compared with all types
        outer = (name in ("$lt", "$lte")) == isinstance(operand, MaxKey)
        return lambda value: outer if key(value)[0] != place else name in ("$gte", "$lte")
    if name in ("$gte", "$lte") and target == NAN:
        return lambda value: key(value) == target
    return {
        "$gt": lambda value: (known := key(value))[0] == place and known > target,
        "$gte": lambda value: (known := key(value))[0] == place and known >= target,
        "$lt": lambda value: (known := key(value))[0] == place and known < target,
        "$lte": lambda value: (known := key(value))[0] == place and known <= target,
    }[name]


def _one_of(operand: Any) -> Test:
    if not isinstance(operand, list):
        raise QueryError("$in and $nin take an array")
    if any(map(has_operators, operand)):
        raise QueryError("$in and $nin take values, no operators")
    patterns = [_pattern(item) for item in operand if isinstance(item, Regex)]
    targets = {key(item) for item in operand if not isinstance(item, Regex)}
    return lambda value: key(value) in targets or any(pattern(value) for pattern in patterns)


def _pattern(regex: Regex[Any]) -> Test:
    return compile_regex(regex.pattern, letters(regex.flags))


def _regex(operand: Any, options: Any) -> Test:
    if options is not None and not isinstance(options, str):
        raise QueryError("$options takes a text")
    if isinstance(operand, Regex):
        own = letters(operand.flags)
        if own and options:
            raise QueryError("options are in $regex or in $options, not in both")
        return compile_regex(operand.pattern, own or options or "")
    return compile_regex(operand, options or "")


def _of_type(operand: Any) -> Test:
    wanted: set[str] = set()
    for item in operand if isinstance(operand, list) else [operand]:
        name = item if isinstance(item, str) else TYPE_NUMBERS.get(whole_number(item) or 0)
        if name == "number":
            wanted |= _NUMBER_TYPES
        elif name is not None and name in TYPE_NUMBERS.values():
            wanted.add(name)
        else:
            raise QueryError(f"$type: there is no type {item!r}")
    if not wanted:
        raise QueryError("$type takes one type at least")
    return lambda value: value is not MISSING and type_name(value) in wanted


def _modulo(operand: Any) -> Test:
    if not isinstance(operand, list) or len(operand) != 2:  # noqa: PLR2004
        raise QueryError("$mod takes [divisor, remainder]")
    divisor, remainder = map(_truncated, operand)
    if not divisor or remainder is None:
        raise QueryError("$mod takes [divisor, remainder], whole numbers, the divisor not 0")

    def test(value: Any) -> bool:
        whole = _truncated(value)
        if whole is None:
            return False
        rest = abs(whole) % abs(divisor)
        return (rest if whole >= 0 else -rest) == remainder  # the sign of the value, as in C

    return test


def _number(value: Any) -> int | float | Decimal | None:
    """Return a number as Python counts with it; None for anything else, and for what is not finite."""
    if isinstance(value, Decimal128):
        value = value.to_decimal()
    if isinstance(value, bool) or not isinstance(value, int | float | Decimal) or not math.isfinite(value):
        return None
    return value


def _truncated(value: Any) -> int | None:
    """Return a number without its fraction; None when there is none of 64 bits."""
    number = _number(value)
    whole = None if number is None else int(number)
    return whole if whole is not None and -(2**63) <= whole < 2**63 else None


def whole_number(value: Any) -> int | None:
    """Return a number that has no fraction as an integer; None for anything else."""
    number = _number(value)
    whole = _truncated(value)
    return whole if whole == number else None
