"""Reads skill strings of the usual form quickly: ``name{key="text", other=1}``, ``name(1, true)``.

Whatever has another form, or a mistake in it, is left to :mod:`cxbridge.skiller.luacalls`, which reads all
that there is and says what is wrong. The tests hold the two against each other.
"""

from __future__ import annotations

import re
from typing import Any, Final

Value = str | float | int | bool | None

# Repetitions give nothing back (*+): no text takes more than a look at each of its characters.
_BLANK: Final = r"[ \t\r\n\f\v]*+"
_NAME: Final = r"([A-Za-z_][A-Za-z0-9_]*+)"
_LITERAL: Final = (
    r"""(?:"([^"\\\r\n]*+)"|'([^'\\\r\n]*+)'|(-?[0-9]{1,15}+(?:\.[0-9]{1,15}+)?+)(?![A-Za-z0-9_.])"""
    r"""|(true|false|nil)(?![A-Za-z0-9_]))"""
)
_START: Final = re.compile(_BLANK)
_CALL: Final = re.compile(rf"{_NAME}[ \t]*+(?:(\{{{_BLANK}\}}|\([ \t]*+\))|(\{{)|\()")
_FIELD: Final = re.compile(rf"{_BLANK}{_NAME}{_BLANK}={_BLANK}{_LITERAL}{_BLANK}([,;}}])")
_VALUE: Final = re.compile(rf"{_BLANK}{_LITERAL}{_BLANK}([,)])")
_END: Final = re.compile(rf"{_BLANK};?{_BLANK}")
_LAST: Final = re.compile(rf"{_BLANK}\}}")

_CONSTANTS: Final = {"nil": None, "true": True, "false": False}
KEYWORDS: Final = frozenset(
    ["and", "break", "do", "else", "elseif", "end", "for", "function", "if", "in", "local", "not"]
) | {"or", "repeat", "return", "then", "until", "while"}
"""Lua's words that name nothing; the constants are not among them."""

_NOT_NAMES: Final = KEYWORDS | _CONSTANTS.keys()

PlainCall = tuple[str, tuple[Any, ...], int]
"""Name, arguments, and where the name stands in the text."""


def plain_calls(text: str) -> list[PlainCall] | None:
    """Return the calls in a skill string; None when it is none of the usual form."""
    calls: list[PlainCall] = []
    at, end = _behind(_START, text, 0), len(text)
    while at < end:
        found = _CALL.match(text, at)
        if found is None or found[1] in _NOT_NAMES:
            return None
        values: tuple[Any, ...] = ()
        at = found.end()
        if found[2] is None:
            read = _fields(text, at) if found[3] else _values(text, at)
            if read is None:
                return None
            values, at = read
        elif found[2][0] == "{":
            values = ({},)
        calls.append((found[1], values, found.start(1)))
        at = _behind(_END, text, at)
    return calls


def _behind(blank: re.Pattern[str], text: str, at: int) -> int:
    """Return where something ends that may be nothing."""
    found = blank.match(text, at)
    return at if found is None else found.end()


def _fields(text: str, at: int) -> tuple[tuple[dict[str, Value]], int] | None:
    """Read what is in the braces of a call, and where they end."""
    table: dict[str, Value] = {}
    while (found := _FIELD.match(text, at)) is not None:
        key, *literal, symbol = found.groups()
        if key in _NOT_NAMES:
            return None
        table[key] = _value(*literal)
        at = found.end()
        if symbol == "}":
            return (table,), at
    last = _LAST.match(text, at)  # after a comma
    return None if last is None else ((table,), last.end())


def _values(text: str, at: int) -> tuple[tuple[Value, ...], int] | None:
    """Read what is in the parentheses of a call, and where they end."""
    values = []
    while (found := _VALUE.match(text, at)) is not None:
        *literal, symbol = found.groups()
        values.append(_value(*literal))
        at = found.end()
        if symbol == ")":
            return tuple(values), at
    return None


def _value(double: str | None, single: str | None, number: str | None, constant: str | None) -> Value:
    if double is not None:
        return double
    if single is not None:
        return single
    if number is None:
        return _CONSTANTS[constant or "nil"]
    value = float(number)
    if not value.is_integer() or (not value and number[0] == "-"):
        return value
    return int(value)
