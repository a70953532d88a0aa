"""Executes the commands that users type in the prompt and in the monitor, and parses their arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.errors import CxbridgeError
from cxbridge.numbers import parse_decimal

_Result = TypeVar("_Result")


def execute_command(
    functions: Mapping[str, Callable[[str], _Result]], command: str, commands_help: str
) -> _Result:
    """Call the function of a command with the rest of the command without outer blanks; return its result.

    :param functions: the functions by the first word of their commands.
    :param commands_help: the hint for an unknown command.
    :raises CxbridgeError: if the command is unknown or fails.
    """
    word, _, argument = command.strip().partition(" ")
    if word not in functions:
        raise CxbridgeError(f"there is no command '{word}'", hint=commands_help)
    return functions[word](argument.strip())


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
