"""Parses the values in a slot of a printed fact."""

from __future__ import annotations

import re

from cxbridge.clipstext.facts import starts_field
from cxbridge.clipstext.values import FactRef, Symbol, Value

_INTEGER = re.compile(r"[+-]?[0-9]+")
_FLOAT = re.compile(r"[+-]?(?:[0-9]+\.[0-9]*|\.?[0-9]+)(?:[eE][+-]?[0-9]+)?")
_FACT_ADDRESS = re.compile(r"<Fact-([0-9]{1,18})>")
_FIRST_EXCESS_INTEGER = 2**63  # the first integer beyond the 64 bits of CLIPS
# limit of an integer's digits: parsing takes quadratic time, and longer numbers never fit into 64 bits
_MAX_DIGITS = 100


def parse_values(text: str) -> tuple[Value, ...]:
    """Return the values in a slot of a printed fact; blanks separate the values.

    A string may contain quotes without escapes: it ends at a quote before the end of the text or before a new
    value.
    """
    values: list[Value] = []
    position = 0
    while position < len(text):
        if text[position] == " ":
            position += 1
        elif text[position] == '"':
            end = position
            while (end := text.find('"', end + 1)) >= 0:
                if end + 1 == len(text) or starts_field(text, end + 1):
                    break
            end = len(text) if end < 0 else end
            values.append(text[position + 1 : end])
            position = end + 1
        else:
            end = text.find(" ", position)
            end = len(text) if end < 0 else end
            values.append(_parse_unquoted_value(text[position:end]))
            position = end
    return tuple(values)


def _parse_unquoted_value(text: str) -> Value:
    """Return the value of a text without quotes: a number, a fact address or a symbol."""
    if len(text) <= _MAX_DIGITS and _INTEGER.fullmatch(text) and abs(int(text)) < _FIRST_EXCESS_INTEGER:
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    address = _FACT_ADDRESS.fullmatch(text)
    return FactRef(int(address[1])) if address else Symbol(text)
