"""Facts as CLIPS prints them, back to templates and slots.

CLIPS 6.30 prints the strings of a fact in quotes and escapes nothing within them::

    (SkillerInterface (id "Skiller") (skill_string "say{text="Good bye", wait=true}") (msgid 3))

so a quote may end a string or belong to it. The rule here: a quote ends the string when what follows can
only be the end of the slot, or the next field of a multislot. Every fact in the recordings reads back right;
a string that holds ``") (`` itself cannot be told from the end of a slot by anybody.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import chain

_SYMBOL = re.compile(r"[^\s()\"]+")
_LEFT_OUT = " ..."
_PLAIN_SLOT = re.compile(r" \(([^\s()\";&|~?<][^\s()\";&|~<]*)([^()\"]*)\)")
_NAME = re.compile(r"[^\s()\";&|~?<][^\s()\";&|~<]*")


class FactSyntaxError(ValueError):
    """The text is no fact, or not a whole one."""


def template_of(text: str) -> str:
    """Return the name of the deftemplate of a printed fact, empty when there is none."""
    match = _NAME.match(text, 1) if text.startswith("(") else None
    return match.group() if match else ""


def parse_fact(text: str) -> tuple[str, Mapping[str, str]]:
    """Split a template fact into the name of its deftemplate and its slots.

    :param text: e.g. ``(goal (id gen8) (error) (message "so it is"))``.
    :returns: the name, and the slots' values as they were printed: ``{"id": "gen8", "error": "", ...}``.
    :raises FactSyntaxError: when the text is no template fact, or cut off.
    """
    template, slots, whole = parse_slots(text)
    if not whole:
        raise FactSyntaxError("not a template fact, or cut off")
    return template, slots


def parse_slots(text: str) -> tuple[str, dict[str, str], bool]:
    """Split a template fact, of which only some slots may be shown, into its deftemplate and these slots.

    :param text: a fact as for :func:`parse_fact`, or as CLIPS 6.4 shows one that is modified:
        ``(goal ... (mode SELECTED) ...)``.
    :returns: the name, the slots that are there, and whether these are all.
    :raises FactSyntaxError: when the text is no template fact, or cut off.
    """
    template = template_of(text)
    if not template:
        raise FactSyntaxError("no fact")
    if '"' not in text and (plain := _plain_slots(template, text)) is not None:
        return template, plain, True
    at = 1 + len(template)
    slots: dict[str, str] = {}
    whole = True
    while True:
        if text.startswith(_LEFT_OUT, at):
            whole = False
            at += len(_LEFT_OUT)
            continue
        if not text.startswith(" (", at):
            break
        name = _NAME.match(text, at + 2)
        if name is None:
            raise FactSyntaxError("a slot without a name")
        start = name.end()
        end = _slot_end(text, start)
        slots[name.group()] = text[start:end].strip()
        at = end + 1
    if text[at:] != ")":
        raise FactSyntaxError("not a template fact, or cut off")
    return template, slots, whole


def _plain_slots(template: str, text: str) -> dict[str, str] | None:
    """Return the slots of a fact that has nothing but slots without strings, fast; None for another one."""
    found = _PLAIN_SLOT.findall(text, 1 + len(template))
    size = sum(map(len, chain.from_iterable(found))) + len(" ()") * len(found)
    if size + len(template) + len("()") != len(text) or not text.endswith(")"):
        return None
    return {name: value.strip() for name, value in found}


def _slot_end(text: str, at: int) -> int:
    """Return the position of the parenthesis that closes the slot whose value starts at ``at``."""
    depth = 0
    while at < len(text):
        char = text[at]
        if char == '"':
            at = _string_end(text, at)
        elif char == "(":
            depth += 1
        elif char == ")":
            if depth == 0:
                return at
            depth -= 1
        at += 1
    raise FactSyntaxError("cut off within a slot")


def _string_end(text: str, start: int) -> int:
    """Return the position of the quote that ends the string which starts at ``start``."""
    at = start
    while (at := text.find('"', at + 1)) >= 0:
        if _ends_slot(text, at + 1) or _starts_field(text, at + 1):
            return at
    raise FactSyntaxError("cut off within a string")


def _ends_slot(text: str, at: int) -> bool:
    """Whether the slot ends here: its parenthesis, then another slot, dots, or the end of the fact."""
    return text.startswith((") (", "))", ") ... (", ") ...)"), at)


def _starts_field(text: str, at: int) -> bool:
    """Whether another field of the multislot starts here: a string, or a symbol without a quote in it."""
    if not text.startswith(" ", at):
        return False
    if text.startswith('"', at + 1):
        return True
    symbol = _SYMBOL.match(text, at + 1)
    return symbol is not None and not text.startswith('"', symbol.end())
