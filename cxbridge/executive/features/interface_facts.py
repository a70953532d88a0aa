"""The mapping between interfaces and CLIPS: deftemplates, slots of facts, and field values.

The mapping is that of Fawkes with three exceptions: NaN and infinities become finite numbers, rules may give
enum items as STRINGs, and rules may write ``byte`` fields.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from enum import IntEnum
from typing import Any, TypeAlias

from cxbridge.clock import split_us
from cxbridge.errors import InterfaceError
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message
from cxbridge.interfaces.schema import FieldSchema

Block: TypeAlias = Interface | Message
"""An object with fields, as the blocks of memory in Fawkes."""

# the facets of slots by the type of the field's values
_FACETS = {
    bool: "(type SYMBOL) (allowed-values TRUE FALSE)",
    float: "(type FLOAT)",
    str: "(type STRING)",
    int: "(type INTEGER)",
}


def _is_multislot(field: FieldSchema) -> bool:
    """Return whether a field needs a multislot."""
    # a string is an array of characters in Fawkes' layout
    return not field.is_string and field.runtime_length > 1


def deftemplate_text(interface: Interface) -> str:
    """Return the text of the deftemplate for facts of this interface type."""
    lines = [
        f"(deftemplate {interface.type}",
        "  (slot id (type STRING))",
        "  (multislot time (type INTEGER) (cardinality 2 2))",
    ]
    for field in interface.SCHEMA.fields:
        facets = "(type SYMBOL)" if field.is_enum else _FACETS[field.storage.python_type]
        slot = "multislot" if _is_multislot(field) else "slot"
        lines.append(f"  ({slot} {field.name} {facets})")
    return "\n".join([*lines, ")"])


def cleanup_function_text(interface_type: str) -> str:
    """Return the text of a deffunction that retracts the facts of an interface, given its id."""
    return (
        f"(deffunction {interface_type}-cleanup-late (?id)\n"
        f"  (do-for-all-facts ((?f {interface_type})) (eq ?f:id ?id) (retract ?f)))"
    )


def cleanup_rule_text(interface_type: str) -> str:
    """Return the text of a rule that retracts the facts of a type at the end of each run of the rules.

    The rule implements ``/clips/retract-early``. Its salience lets all other rules fire before.
    """
    return (
        f"(defrule {interface_type}-cleanup"
        f" (declare (salience -10000)) ?f <- ({interface_type}) => (retract ?f))"
    )


def fact_slots(interface: Interface) -> dict[str, Value]:
    """Return the slots of the fact about an interface."""
    slots: dict[str, Value] = {"id": interface.id, "time": split_us(interface.timestamp_us)}
    for field in interface.SCHEMA.fields:
        value = getattr(interface, field.name)
        convert = _to_clips_symbol if field.is_enum else _TO_CLIPS[field.storage.python_type]
        elements = tuple(map(convert, value if field.is_array else (value,)))
        # as in Fawkes, an array of one element is a single slot
        slots[field.name] = elements if _is_multislot(field) else elements[0]
    return slots


def _to_clips_symbol(value: Value) -> Symbol:
    """Return the name of an enum's item; UNKNOWN for a number that the enum lacks."""
    # another process may write any number
    return Symbol(value.name if isinstance(value, IntEnum) else "UNKNOWN")


def _to_clips_float(value: float) -> float:
    """Return a number with six decimals, as in Fawkes.

    NaN and infinity become the greatest double, negative infinity becomes the lowest.
    """
    # CLIPS has neither infinities nor NaN
    if math.isfinite(value):
        return float(f"{value:f}")
    return -sys.float_info.max if value == -math.inf else sys.float_info.max


_TO_CLIPS: dict[type, Callable[[Any], Value]] = {
    bool: lambda value: TRUE if value else FALSE,
    int: int,
    float: _to_clips_float,
    str: str,
}


def store_field(block: Block, name: str, value: Value) -> None:
    """Set a field from a CLIPS value.

    Of an array, a multifield sets the first elements, and a single value sets the first element.

    :raises InterfaceError: if the field is unknown or the value does not fit.
    """
    field = next((field for field in block.SCHEMA.fields if field.name == name), None)
    if field is None:
        raise InterfaceError(f"Can't find field {name} in {block.type}")
    if not isinstance(value, tuple):
        block.set(name, _from_clips(block, field, value), 0 if field.is_array else None)
        return
    if not field.is_array:
        raise InterfaceError(f"field {name} of {block.type} takes one value, not a multifield")
    # surplus values of a multifield are dropped
    for index, element in enumerate(value[: field.runtime_length]):
        block.set(name, _from_clips(block, field, element), index)


def _from_clips(block: Block, field: FieldSchema, value: Value) -> Value:
    """Convert a CLIPS value to the value of a field.

    :raises InterfaceError: if the field's type has no such value.
    """
    if field.enum is not None:
        items = {item.name: item.value for item in field.enum.items}
        if str(value) in items:
            return items[str(value)]
        expected = f"one of {', '.join(items)}"
    elif field.storage.python_type is bool:
        if str(value) in (TRUE, FALSE):
            return str(value) == TRUE
        expected = "TRUE or FALSE"
    elif field.is_string:
        if isinstance(value, str):
            return str(value)
        expected = "a STRING or SYMBOL"
    elif field.storage.python_type is float:
        if isinstance(value, (int, float)):
            return float(value)
        expected = "a number"
    else:
        if isinstance(value, int):
            return value
        expected = "an INTEGER"
    raise InterfaceError(f"field {field.name} of {block.type} takes {expected}, not {value}")
