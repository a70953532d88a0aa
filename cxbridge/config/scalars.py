"""Types and values of scalar texts by the conversion rules of Fawkes.

Fawkes stores the text of a scalar without its quotes. The type of a value is the first of UINT, INT, FLOAT,
BOOL and STRING to which its text converts, so ``"1"`` is a UINT and ``"on"`` a BOOL. The conversions are
those of C and C++ (``strtol`` with base 0, formatted stream input), as in Fawkes'
``libs/config/yaml_node.h``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from enum import Enum

UINT_MAX = 2**32 - 1
INT_MAX = 2**31 - 1
LONG_MAX = 2**63 - 1  # C's long on 64-bit machines, to which strtol converts


class ConfigType(Enum):
    """The type of a value; the name is the symbol in CLIPS' ``confval`` facts."""

    UINT = "unsigned integer"
    INT = "integer"
    FLOAT = "float"
    BOOL = "boolean"
    STRING = "string"


_DIGITS = r"(?:0[xX](?P<hex>[0-9a-fA-F]+)|(?P<octal>0[0-7]*)|(?P<decimal>[1-9][0-9]*))"
_SPACE = r"[ \t\n\v\f\r]*"
_STRTOL = re.compile(rf"{_SPACE}(?P<sign>[+-]?){_DIGITS}")  # strtol must read the whole text: no blanks after
_STREAM_INT = re.compile(rf"{_SPACE}(?P<sign>[+-]?){_DIGITS}{_SPACE}")
_STREAM_FLOAT = re.compile(
    rf"{_SPACE}(?P<number>[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?){_SPACE}"
)
_BOOL_BY_WORD = {
    "y": True,
    "yes": True,
    "true": True,
    "on": True,
    "n": False,
    "no": False,
    "false": False,
    "off": False,
}
_INFINITY = {f"{sign}{word}" for sign in ("", "+", "-") for word in (".inf", ".Inf", ".INF")}
_NAN = {".nan", ".NaN", ".NAN"}
# the least number that rounds to an infinite float32, which the C++ stream refuses
_FLOAT32_OVERFLOW = float.fromhex("0x1.ffffffp127")


def _parse_integer(match: re.Match[str]) -> int:
    digits, base = match["decimal"], 10
    if match["hex"] is not None:
        digits, base = match["hex"], 16
    elif match["octal"] is not None:
        digits, base = match["octal"], 8
    max_digits = 25  # more digits exceed 64 bits in any base; megabytes of digits would take long to convert
    value = LONG_MAX + 1 if len(digits.lstrip("0")) > max_digits else int(digits, base)
    return -value if match["sign"] == "-" else value


def to_uint(text: str) -> int | None:
    """Return ``text`` as an unsigned integer up to 2**63-1, or None."""
    match = _STRTOL.fullmatch(text)
    if match is None:
        return None
    value = _parse_integer(match)
    return value if 0 <= value <= LONG_MAX else None


def to_uint32(text: str) -> int | None:
    """Return ``text`` as an unsigned integer of 32 bits, or None.

    Values of the type UINT have up to 63 bits, as in Fawkes; its getter and its network protocol have 32.
    """
    value = to_uint(text)
    return value if value is not None and value <= UINT_MAX else None


def to_int(text: str) -> int | None:
    """Return ``text`` as a 32-bit integer, or None."""
    match = _STREAM_INT.fullmatch(text)
    if match is None:
        return None
    value = _parse_integer(match)
    return value if -INT_MAX - 1 <= value <= INT_MAX else None


def to_float(text: str) -> float | None:
    """Return ``text`` as a number, ``.inf`` or ``.nan``; None for other texts and beyond float32.

    Fawkes reads ``-.inf`` as +infinity; here it is negative.
    """
    match = _STREAM_FLOAT.fullmatch(text)
    if match is not None:
        value = float(match["number"])
        return value if abs(value) < _FLOAT32_OVERFLOW else None
    if text in _INFINITY:
        return -math.inf if text.startswith("-") else math.inf
    return math.nan if text in _NAN else None


def to_bool(text: str) -> bool | None:
    """Return ``text`` as a truth value, or None.

    The words are y, yes, true, on, n, no, false, off; each in lower case, upper case or capitalised.
    """
    is_uniform = text in (text.lower(), text.upper(), text.capitalize())
    return _BOOL_BY_WORD.get(text.lower()) if is_uniform else None


CONVERTERS: Mapping[ConfigType, Callable[[str], bool | int | float | str | None]] = {
    ConfigType.UINT: to_uint,
    ConfigType.INT: to_int,
    ConfigType.FLOAT: to_float,
    ConfigType.BOOL: to_bool,
    ConfigType.STRING: str,
}
"""The conversion of a text to each type, in the order in which types are tried; None for other texts."""


def scalar_type(text: str) -> ConfigType:
    """Return the first type to which a scalar's text converts."""
    return next(kind for kind, convert in CONVERTERS.items() if convert(text) is not None)
