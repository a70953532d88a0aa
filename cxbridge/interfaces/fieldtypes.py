"""Types of fields and their literals in XML.

The types are those of Fawkes' interface generator. Sizes are those of the x86-64 and aarch64 ABIs, in which
every scalar is aligned to its size.
"""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Callable
from typing import Any

from msgspec import Struct

# The lengths bound the time for hostile numbers; 20 digits are enough for any 64-bit integer. Blanks before a
# number are allowed, but not after it: Fawkes' generator uses strtoll and strtod.
_INTEGER = re.compile(r"\s*[+-]?[0-9]{1,20}")
_DECIMAL = re.compile(r"\s*[+-]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,6})?")
_INT64_MAX = (1 << 63) - 1
_BOOL_LITERALS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


class FieldType(Struct, frozen=True):
    """A scalar type: the only description of the type, from which all other modules derive their conversions.

    :param name: the name of the type in XML.
    :param python_type: the type of values: bool, int, float or str.
    :param code: the character of an element in :mod:`struct`.
    :param c_type: the type of an element in :mod:`ctypes`.
    :param digits: the number of decimal digits that distinguish all values of a float type; 0 for other
        types.
    """

    name: str
    python_type: type
    code: str
    c_type: Any
    digits: int = 0

    @property
    def size(self) -> int:
        """The number of bytes of an element, also its alignment."""
        return ctypes.sizeof(self.c_type)

    @property
    def limits(self) -> tuple[int, int]:
        """The minimum and the maximum of an integer type."""
        bits = 8 * self.size
        # the struct codes of signed integers are in lower case
        return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if self.code.islower() else (0, (1 << bits) - 1)

    @property
    def allowed_values(self) -> str:
        """The allowed values in words, for error messages."""
        if self.python_type is int:
            return "an integer from {} to {}".format(*self.limits)
        return {bool: "True or False", str: "a string", float: "a number"}[self.python_type]

    def round(self, value: float) -> float:
        """Return the nearest value of a float type; infinity for a number beyond its range."""
        return float(self.c_type(value).value)


TYPES: dict[str, FieldType] = {
    field_type.name: field_type
    for field_type in (
        FieldType("bool", bool, "?", ctypes.c_bool),
        FieldType("int8", int, "b", ctypes.c_int8),
        FieldType("uint8", int, "B", ctypes.c_uint8),
        FieldType("int16", int, "h", ctypes.c_int16),
        FieldType("uint16", int, "H", ctypes.c_uint16),
        FieldType("int32", int, "i", ctypes.c_int32),
        FieldType("uint32", int, "I", ctypes.c_uint32),
        FieldType("int64", int, "q", ctypes.c_int64),
        FieldType("uint64", int, "Q", ctypes.c_uint64),
        FieldType("float", float, "f", ctypes.c_float, digits=9),
        FieldType("double", float, "d", ctypes.c_double, digits=17),
        FieldType("string", str, "s", ctypes.c_char),
        FieldType("byte", int, "B", ctypes.c_uint8),
    )
}
"""The built-in types by XML name."""

ENUM_TYPE = TYPES["int32"]
"""The storage type of enum values."""


def storage_type(type_name: str) -> FieldType:
    """Return the storage type of a field; names of other types are names of enums."""
    return TYPES.get(type_name, ENUM_TYPE)


def parse_literal(type_name: str, text: str) -> bool | int | float | str | None:
    """Parse a literal as strictly as Fawkes' generator.

    A ``float`` is rounded to 32 bits, as the value of a field. Return None if the text is not a literal of
    the type. Enums and ``byte`` have no literals: the generator allows none.
    """
    field_type = TYPES.get(type_name)
    if field_type is None or type_name == "byte":
        return None
    return _PARSERS[field_type.python_type](field_type, text)


def _parse_integer(field_type: FieldType, text: str) -> int | None:
    """Parse a decimal integer; return None for other texts and for numbers out of range."""
    if not _INTEGER.fullmatch(text):
        return None
    minimum, maximum = field_type.limits
    # Fawkes reads all integers through a signed 64-bit integer, also for uint64
    return number if minimum <= (number := int(text)) <= min(maximum, _INT64_MAX) else None


def _parse_decimal(field_type: FieldType, text: str) -> float | None:
    """Parse a decimal number; return None for other texts and for numbers out of the type's range."""
    if not _DECIMAL.fullmatch(text):
        return None
    value = field_type.round(float(text))
    return value if math.isfinite(value) else None


_PARSERS: dict[type, Callable[[FieldType, str], bool | int | float | str | None]] = {
    bool: lambda _, text: _BOOL_LITERALS.get(text),
    int: _parse_integer,
    float: _parse_decimal,
    str: lambda _, text: text,
}
