"""Types of fields and their literals in XML.

The types are those of Fawkes' interface generator. Sizes are those of the x86-64 and aarch64 ABIs, in which
every scalar is aligned to its size.
"""

from __future__ import annotations

import ctypes
import math
import re

from msgspec import Struct

# The lengths bound the time for hostile numbers; 20 digits are enough for any 64-bit integer.
_INTEGER = re.compile(r"\s*[+-]?[0-9]{1,20}")
_DECIMAL = re.compile(r"\s*[+-]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,6})?")
_INT64_MAX = (1 << 63) - 1
_BOOL_LITERALS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


class FieldType(Struct, frozen=True):
    """A scalar type.

    :param name: the name of the type in XML.
    :param code: the character of an element in :mod:`struct`.
    :param size: the number of bytes of an element, also its alignment.
    :param minimum: the minimum of an integer type.
    :param maximum: the maximum of an integer type.
    """

    name: str
    code: str
    size: int
    minimum: int | None = None
    maximum: int | None = None

    @property
    def allowed_values(self) -> str:
        """The allowed values in words, for error messages."""
        if self.minimum is not None:
            return f"an integer from {self.minimum} to {self.maximum}"
        return {"bool": "True or False", "string": "a string"}.get(self.name, "a number")


def _make_integer_type(name: str, code: str, size: int) -> FieldType:
    """Return an integer type; a lower case code means signed."""
    bits = 8 * size
    if code.islower():
        return FieldType(name, code, size, -(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    return FieldType(name, code, size, 0, (1 << bits) - 1)


TYPES: dict[str, FieldType] = {
    field_type.name: field_type
    for field_type in (
        FieldType("bool", "?", 1),
        _make_integer_type("int8", "b", 1),
        _make_integer_type("uint8", "B", 1),
        _make_integer_type("int16", "h", 2),
        _make_integer_type("uint16", "H", 2),
        _make_integer_type("int32", "i", 4),
        _make_integer_type("uint32", "I", 4),
        _make_integer_type("int64", "q", 8),
        _make_integer_type("uint64", "Q", 8),
        FieldType("float", "f", 4),
        FieldType("double", "d", 8),
        FieldType("string", "s", 1),
        _make_integer_type("byte", "B", 1),
    )
}
"""The built-in types by XML name."""

ENUM_TYPE = TYPES["int32"]
"""The storage type of enum values."""


def storage_type(type_name: str) -> FieldType:
    """Return the storage type of a field; names of other types are names of enums."""
    return TYPES.get(type_name, ENUM_TYPE)


def parse_literal(type_name: str, text: str) -> bool | int | float | str | None:
    """Parse a literal as strictly as Fawkes' generator, or return None.

    The generator allows no literals of type ``byte``. A ``float`` is rounded to 32 bits, as the value of a
    field.
    """
    if type_name == "string":
        return text
    if type_name == "bool":
        return _BOOL_LITERALS.get(text)
    if type_name in ("float", "double"):
        return _parse_decimal(type_name, text)
    field_type = TYPES.get(type_name)
    if field_type is None or type_name == "byte":
        return None
    return _parse_integer(field_type, text)


def _parse_integer(field_type: FieldType, text: str) -> int | None:
    if field_type.minimum is None or field_type.maximum is None or not _INTEGER.fullmatch(text):
        return None
    # Fawkes reads all integers through a signed 64-bit integer, also for uint64
    maximum = min(field_type.maximum, _INT64_MAX)
    number = int(text)
    return number if field_type.minimum <= number <= maximum else None


def _parse_decimal(type_name: str, text: str) -> float | None:
    """Parse a decimal number in the range of a type, or return None."""
    if not _DECIMAL.fullmatch(text):
        return None
    value = round_to_float(float(text)) if type_name == "float" else float(text)
    return value if math.isfinite(value) else None


def round_to_float(value: float) -> float:
    """Round to the nearest 32-bit float, or to infinity."""
    return ctypes.c_float(value).value
