"""Parses the arguments of commands about facts, for the prompt, the monitor and ``cxbridge env``."""

from __future__ import annotations

from collections.abc import Mapping

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.errors import CxbridgeError
from cxbridge.numbers import parse_decimal


def parse_number(word: str) -> int:
    """Return the number of a breakpoint, or the index of a fact with or without ``f-``.

    :raises CxbridgeError: if the word is not a number.
    """
    number = parse_decimal(word.removeprefix("f-"))
    if number is None:
        raise CxbridgeError(f"'{word}' is not a number", hint="use a number, e.g. 12, or f-12 for a fact")
    return number


def parse_fact_change(text: str) -> tuple[int, Mapping[str, str]]:
    """Return the index of a fact and its new slots, from ``INDEX (SLOT VALUE)...``.

    :raises CxbridgeError: if the text has another form.
    """
    word, _, slots = text.partition(" ")
    try:
        return parse_number(word), parse_fact(f"(fact {slots.strip()})")[1]
    except FactSyntaxError:
        hint = "modify INDEX (SLOT VALUE)..., e.g. modify 12 (mode FINISHED)"
        raise CxbridgeError(f"'{slots}' names no slots", hint=hint) from None
