"""Parses the values in a slot of a printed fact."""

from __future__ import annotations

import re

from cxbridge.clipstext.values import FactRef, Symbol, Value

# A string or a word. CLIPS 6.30 prints the quotes in a string without escapes, so a string ends only at a
# quote before the end of the text, before another string, or before a word without a quote. A string that is
# cut off extends to the end of the text.
_FIELD = re.compile(
    r"""
    "(?P<string>.*?)(?:"(?=\Z|[ ]"|[ ][^\s()"]++(?!"))|\Z)
    |(?P<word>[^ "][^ ]*)
    """,
    re.DOTALL | re.VERBOSE,
)
_INTEGER = re.compile(r"[+-]?[0-9]+")
_FLOAT = re.compile(r"[+-]?(?:[0-9]+\.[0-9]*|\.?[0-9]+)(?:[eE][+-]?[0-9]+)?")
# An index of 18 digits always fits into the 64 bits of CLIPS.
_FACT_ADDRESS = re.compile(r"<Fact-([0-9]{1,18})>")
_FIRST_EXCESS_INTEGER = 2**63  # the first positive integer beyond the 64 bits of CLIPS
# The limit of an integer's digits: parsing takes quadratic time, and 64 bits need at most 19 digits.
_MAX_DIGITS = 100


def parse_values(text: str) -> tuple[Value, ...]:
    """Return the values in a slot of a printed fact; blanks separate the values."""
    return tuple(
        _parse_word(match["word"]) if match["word"] else match["string"] for match in _FIELD.finditer(text)
    )


def _parse_word(text: str) -> Value:
    """Return the value of a text without quotes: a number, a fact address or a symbol.

    An integer that does not fit into 64 bits becomes a float.
    """
    if (
        len(text) <= _MAX_DIGITS
        and _INTEGER.fullmatch(text)
        and -_FIRST_EXCESS_INTEGER <= int(text) < _FIRST_EXCESS_INTEGER
    ):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    address = _FACT_ADDRESS.fullmatch(text)
    return FactRef(int(address[1])) if address else Symbol(text)
