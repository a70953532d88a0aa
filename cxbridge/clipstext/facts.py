"""Parsing and printing of facts in the form of CLIPS: deftemplate, slots, values.

CLIPS 6.30 prints strings within facts in quotes without escaping::

    (SkillerInterface (id "Skiller") (skill_string "say{text="Good bye", wait=true}") (msgid 3))

A quote may therefore end a string or belong to it. The parser first assumes that a quote ends its string
wherever the end of the slot or the next field of a multislot can follow. If this fails or finds too few
slots, the slots in :data:`LAYOUTS` help: a slot ends where the next known slot starts, and the text between
must have the form of a value. A string that contains the end of its slot and the start of the next slot is
ambiguous.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import chain
from typing import Final

from cxbridge.clipstext.goal_slots import GOAL_SLOTS
from cxbridge.clipstext.values import Value, value_text

LAYOUTS: Final[Mapping[str, tuple[str, ...]]] = {
    "SkillerInterface": ("id", "time", "skill_string", "error", "exclusive_controller", "msgid", "status"),
    "goal": tuple(slot.name for slot in GOAL_SLOTS),
    # unpacked tuples, because the formatter would write a single tuple with one name a line
    "plan-action": (
        *("id", "goal-id", "plan-id", "skiller", "action-name", "param-names", "param-values", "duration"),
        *("dispatch-time", "state", "executable", "error-msg", "start-time", "precondition"),
    ),
}
"""The slots of deftemplates in the order in which CLIPS prints them in Fawkes; a fact may lack some.

The core of cxbridge declares the slots of plan-action in another order. Only the quotes separate those slots.
"""

# a value: words without quotes, or fields with at least one string, which may contain quotes
_VALUE = re.compile(r'(?:[^()"]*|(?: [^\s()"]+)* ".*"(?: [^\s()"]+)*)', re.DOTALL)
_SYMBOL = re.compile(r"[^\s()\"]+")
_OMISSION = " ..."  # printed by CLIPS 6.4 in place of unchanged slots of a modified fact
_SLOT_WITHOUT_STRINGS = re.compile(r" \(([^\s()\";&|~?<][^\s()\";&|~<]*)([^()\"]*)\)")
_PARENTHESIS_OR_QUOTE = re.compile(r"[()\"]")
_SLOT_NAME = re.compile(r"[^\s()\";&|~?<][^\s()\";&|~<]*")

IMPLIED: Final = "implied"
"""The only slot of an ordered fact, which is not printed."""


class FactSyntaxError(ValueError):
    """The text is not a fact, or is truncated."""


def template_of(text: str) -> str:
    """Return the deftemplate of a printed fact, empty if there is none."""
    match = _SLOT_NAME.match(text, 1) if text.startswith("(") else None
    return match.group() if match else ""


def parse_fact(text: str) -> tuple[str, Mapping[str, str]]:
    """Split a template fact into the name of its deftemplate and its slots.

    :param text: e.g. ``(goal (id gen8) (error) (message "so it is"))``.
    :returns: the name, and the slots' printed values: ``{"id": "gen8", "error": "", ...}``.
    :raises FactSyntaxError: if the text is not a template fact, or truncated.
    """
    template, slots, is_complete = parse_slots(text)
    if not is_complete:
        raise FactSyntaxError("not a template fact, or cut off")
    return template, slots


def parse_slots(text: str) -> tuple[str, dict[str, str], bool]:
    """Split a template fact, possibly with omitted slots, into its deftemplate and slots.

    :param text: a fact as for :func:`parse_fact`, or a modified fact as CLIPS 6.4 prints it: ``(goal ...
        (mode SELECTED) ...)``.
    :returns: the name, the slots, and whether none is omitted.
    :raises FactSyntaxError: if the text is not a template fact, or truncated.
    """
    template = template_of(text)
    if not template:
        raise FactSyntaxError("no fact")
    if (
        '"' not in text
        and (slots_without_strings := _parse_slots_without_strings(template, text)) is not None
    ):
        return template, slots_without_strings, True
    # without a layout a quote ends a string where a field or a slot may end
    if template not in LAYOUTS:
        return template, *_parse_by_quotes(text, template)
    names = LAYOUTS[template]
    try:
        slots, is_complete = _parse_by_quotes(text, template)
    except FactSyntaxError:
        # a quote within a string may have ended the string too early
        slots = _LayoutParser(text, names).read(len("(") + len(template)) or {}
        if not slots:
            raise
        return template, slots, True
    if is_complete and len(slots) < len(names):
        # a string may contain the start of slots, or the fact has unknown slots
        layout_slots = _LayoutParser(text, names).read(len("(") + len(template))
        if layout_slots is not None and len(layout_slots) > len(slots):
            slots = layout_slots
    return template, slots, is_complete


def _parse_by_quotes(text: str, template: str) -> tuple[dict[str, str], bool]:
    """Return the slots of a fact, found by the quotes of its strings, and whether none is omitted."""
    position = len("(") + len(template)
    slots: dict[str, str] = {}
    is_complete = True
    while True:
        if text.startswith(_OMISSION, position):
            is_complete = False
            position += len(_OMISSION)
            continue
        if not text.startswith(" (", position):
            break
        name = _SLOT_NAME.match(text, position + 2)
        if name is None:
            raise FactSyntaxError("a slot without a name")
        start = name.end()
        end = _find_slot_end(text, start)
        slots[name.group()] = text[start:end].strip()
        position = end + 1
    if text[position:] != ")":
        raise FactSyntaxError("not a template fact, or cut off")
    return slots, is_complete


def _parse_slots_without_strings(template: str, text: str) -> dict[str, str] | None:
    """Return the slots of a fact without strings, found by a single search; None for other facts."""
    slots = _SLOT_WITHOUT_STRINGS.findall(text, len("(") + len(template))
    # the slots that were found must make up the whole text
    size = sum(map(len, chain.from_iterable(slots))) + len(" ()") * len(slots)
    if size + len(template) + len("()") != len(text) or not text.endswith(")"):
        return None
    return {name: value.strip() for name, value in slots}


class _LayoutParser:
    """Parses a fact with known slots.

    :param names: the names of the slots in the order of printing.
    """

    def __init__(self, text: str, names: tuple[str, ...]) -> None:
        self._text, self._names = text, names
        self._slot_starts = tuple(f" ({name}" for name in names)
        # the slots and positions from which the end cannot be reached: without this memory, a text with many
        # parentheses would take exponential time
        self._dead_ends: set[tuple[int, int]] = set()

    def read(self, position: int) -> dict[str, str] | None:
        """Return the slots, or None if the fact has unknown slots or another order.

        :param position: the position after the deftemplate.
        """
        slots = self._parse_reversed_slots(0, position)
        return None if slots is None else dict(reversed(slots))

    def _parse_reversed_slots(self, first: int, position: int) -> list[tuple[str, str]] | None:
        """Return names and values of the slots from a position on, the last slot first.

        None if the remaining text is not a sequence of known slots. The order is reversed, because each call
        appends its slot to the later slots.

        :param first: the lowest number that the next slot may have.
        """
        if self._is_end(position):
            return []
        number = self._slot_number_at(first, position)
        if number is None or (number, position) in self._dead_ends:
            return None
        start = position + len(self._slot_starts[number])
        end = start - 1
        # the shortest value first: a slot rarely contains the start of the next slot
        while (end := self._text.find(")", end + 1)) >= 0:
            can_continue = self._is_end(end + 1) or self._slot_number_at(number + 1, end + 1) is not None
            if can_continue and _VALUE.fullmatch(self._text, start, end):
                later_slots = self._parse_reversed_slots(number + 1, end + 1)
                if later_slots is not None:
                    later_slots.append((self._names[number], self._text[start:end].strip(" ")))
                    return later_slots
        self._dead_ends.add((number, position))
        return None

    def _slot_number_at(self, first: int, position: int) -> int | None:
        """Return the number of the known slot that starts at a position; None if no slot does.

        :param first: the lowest number that the slot may have.
        """
        if not self._text.startswith(" (", position):
            return None
        for number in range(first, len(self._names)):
            start = self._slot_starts[number]
            if self._text.startswith((f"{start} ", f"{start})"), position):
                return number
        return None

    def _is_end(self, position: int) -> bool:
        """Return whether only the last parenthesis of the fact follows."""
        return position + 1 == len(self._text) and self._text.endswith(")")


def _find_slot_end(text: str, position: int) -> int:
    """Return the position of the parenthesis that closes the slot whose value starts at ``position``."""
    depth = 0
    while (match := _PARENTHESIS_OR_QUOTE.search(text, position)) is not None:
        position = match.start()
        character = text[position]
        if character == '"':
            position = _find_string_end(text, position)
        elif character == "(":
            depth += 1
        elif depth == 0:
            return position
        else:
            depth -= 1
        position += 1
    raise FactSyntaxError("cut off within a slot")


def _find_string_end(text: str, start: int) -> int:
    """Return the position of the quote that ends the string starting at ``start``."""
    position = start
    while (position := text.find('"', position + 1)) >= 0:
        if _ends_slot(text, position + 1) or starts_field(text, position + 1):
            return position
    raise FactSyntaxError("cut off within a string")


def _ends_slot(text: str, position: int) -> bool:
    """Return whether the slot ends: a parenthesis, then another slot, dots, or the end of the fact."""
    return text.startswith((") (", "))", ") ... (", ") ...)"), position)


def starts_field(text: str, position: int) -> bool:
    """Return whether another field of the multislot starts: a string, or a symbol without quote."""
    if not text.startswith(" ", position):
        return False
    if text.startswith('"', position + 1):
        return True
    symbol = _SYMBOL.match(text, position + 1)
    return symbol is not None and not text.startswith('"', symbol.end())


def fact_text(template: str, slots: Mapping[str, Value]) -> str:
    """Return a fact in the form of CLIPS, without its index.

    :param slots: the values by name; for an ordered fact all in :data:`IMPLIED`.
    """
    if list(slots) == [IMPLIED]:
        return f"({template} {value_text(slots[IMPLIED])}".rstrip() + ")"
    texts = (f" ({slot} {value_text(value)}".rstrip() + ")" for slot, value in slots.items())
    return f"({template}{''.join(texts)})"
