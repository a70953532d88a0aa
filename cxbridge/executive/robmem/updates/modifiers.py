"""The update operators on single values."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from datetime import datetime
from decimal import Context, localcontext
from typing import Any, NamedTuple

from bson import Decimal128, Int64, Timestamp
from bson.decimal128 import create_decimal128_context

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import MISSING, NAN, NUMBERS, key, type_name


class _Keep:
    """Stands for a value that stays as it is, or stays away."""


KEEP = _Keep()


class UpdateMoment(NamedTuple):
    """When an update is done.

    :param date: the time.
    :param stamp: makes a timestamp that nothing else has.
    """

    date: datetime
    stamp: Callable[[], Timestamp]


Modify = Callable[[Any, UpdateMoment], Any]
"""Returns the new value for the old one, which may be missing; missing to remove it, or :data:`KEEP`."""


def _set(_path: str, operand: Any) -> Modify:
    return lambda _old, _moment: operand


def _unset(_path: str, _operand: Any) -> Modify:
    return lambda _old, _moment: MISSING


def _arithmetic(name: str) -> Callable[[str, Any], Modify]:
    compute = operator.add if name == "$inc" else operator.mul

    def make(path: str, operand: Any) -> Modify:
        if not _is_number(operand):
            raise QueryError(f"{name} of '{path}' takes a number")

        def modify(old: Any, _moment: UpdateMoment) -> Any:
            if old is MISSING:
                return operand if name == "$inc" else _counted(operator.mul, operand, 0)
            if not _is_number(old):
                raise QueryError(f"{name}: '{path}' is not a number")
            result = _counted(compute, old, operand)
            if isinstance(result, int) and not -(2**63) <= result < 2**63:
                raise QueryError(f"{name}: '{path}' would be {result}, more than an integer can hold")
            return result

        return modify

    return make


def _is_number(value: Any) -> bool:
    return key(value)[0] in (NUMBERS, NAN[0])


def _counted(compute: Callable[[Any, Any], Any], one: Any, other: Any) -> Any:
    """Return the result as the greater type of the two: int, long, double, decimal."""
    kinds = {type_name(one), type_name(other)}
    if "decimal" in kinds:
        context: Context = create_decimal128_context()
        with localcontext(context) as current:
            return Decimal128(compute(_decimal(one, current), _decimal(other, current)))
    if "double" in kinds:
        return float(compute(float(one), float(other)))
    result = compute(int(one), int(other))
    return Int64(result) if "long" in kinds and -(2**63) <= result < 2**63 else result


def _decimal(value: Any, context: Context) -> Any:
    """Return a number as a decimal; a double with the 15 digits that it holds for sure."""
    if isinstance(value, Decimal128):
        return value.to_decimal()
    return context.create_decimal(f"{value:.15g}" if isinstance(value, float) else int(value))


def _extreme(name: str) -> Callable[[str, Any], Modify]:
    def make(_path: str, operand: Any) -> Modify:
        target = key(operand)

        def modify(old: Any, _moment: UpdateMoment) -> Any:
            if old is MISSING:
                return operand
            return operand if (target < key(old) if name == "$min" else target > key(old)) else KEEP

        return modify

    return make


def _current_date(path: str, operand: Any) -> Modify:
    kind = operand.get("$type") if isinstance(operand, Mapping) and len(operand) == 1 else None
    if isinstance(operand, bool) or kind == "date":
        return lambda _old, moment: moment.date
    if kind == "timestamp":
        return lambda _old, moment: moment.stamp()
    raise QueryError(f"$currentDate of '{path}' takes true, or {{$type: 'date'}} or {{$type: 'timestamp'}}")


OPERATORS: dict[str, Callable[[str, Any], Modify]] = {
    "$set": _set,
    "$unset": _unset,
    "$inc": _arithmetic("$inc"),
    "$mul": _arithmetic("$mul"),
    "$min": _extreme("$min"),
    "$max": _extreme("$max"),
    "$currentDate": _current_date,
}
"""By name, what makes of a path and an operand what modifies a value."""
