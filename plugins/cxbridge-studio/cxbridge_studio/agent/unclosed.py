"""Finds the unclosed list of a construct from its indentation and from the syntax of CLIPS.

A parser notices a missing parenthesis only at the end of the construct, but any list in the construct may be
the open list. A list counts as open if a line begins no deeper than the list, or if the list contains a word
that cannot be in it, such as a slot in another slot, or an arrow in a pattern.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, TOKEN, Lines, read_nodes
from cxbridge_studio.agent.clips import SLOT_KEYWORDS

_TAB_COLUMNS: Final = 2  # columns of a tab in Fawkes' files
_BEGINNING: Final = re.compile(r"\((def\w+)\s+([^\s()\";]+)")


class _OpenList(Struct):
    """A list that is still open.

    :param column: the column of the opening parenthesis, with tabs expanded.
    :param head: the first word of the list.
    """

    start: int
    column: int
    head: str = ""


def find_unclosed_lists(text: str, slots: Mapping[str, Collection[str]] | None = None) -> list[int]:
    """Return the offsets of the unclosed lists of a construct, in the order of the text.

    :param text: the text of the construct, up to the start of the next construct.
    :param slots: the slot names of the known deftemplates, by deftemplate; none by default.
    """
    slots = slots or {}
    open_lists: list[_OpenList] = []
    unclosed_starts: list[int] = []
    line_start, is_first_in_line = 0, True
    previous_token = ""
    for match in TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "blank":
            if "\n" in token:
                line_start, is_first_in_line = match.start() + token.rindex("\n") + 1, True
            continue
        column = len(text[line_start : match.start()].expandtabs(_TAB_COLUMNS))
        is_head = previous_token == "("
        # The construct itself does not count: its content may begin at the start of a line.
        while len(open_lists) > 1 and (
            token == "=>"
            or (token in ("then", "else") and open_lists[-1].head != "if")
            or (is_first_in_line and token != ")" and column <= open_lists[-1].column)
            or (is_head and _is_misplaced(token, open_lists, slots))
        ):
            # A head belongs to the list that was just opened: the parent of that list is the unclosed list.
            unclosed_starts.append(open_lists.pop(-2 if is_head else -1).start)
        if token == "(":
            open_lists.append(_OpenList(match.start(), column))
        elif token == ")" and open_lists:
            open_lists.pop()
        elif is_head and open_lists:
            open_lists[-1].head = token
        is_first_in_line, previous_token = False, token
    return sorted([*unclosed_starts, *(open_list.start for open_list in open_lists)])


def _is_misplaced(head: str, open_lists: list[_OpenList], slots: Mapping[str, Collection[str]]) -> bool:
    """Return whether a list cannot be in its parent: a slot in a slot.

    :param head: the first word of the innermost list.
    """
    if len(open_lists) < 3:  # noqa: PLR2004 - the construct, the list around, and the list with the head
        return False
    outer, parent = open_lists[-3].head, open_lists[-2].head
    if head in SLOT_KEYWORDS:
        return parent in SLOT_KEYWORDS
    # modify and duplicate do not name the template of the fact, so any template may match.
    templates = slots.values() if outer in ("modify", "duplicate") else [slots.get(outer, ())]
    return any(head in names and parent in names for names in templates)


class UnclosedConstruct(Struct, frozen=True):
    """An unclosed construct.

    :param start: the offset of the unclosed list, or of the construct if a string is unclosed.
    """

    start: int
    message: str
    hint: str


def describe_unclosed(
    construct: str, start: int, lines: Lines, text: str, slots: Mapping[str, Collection[str]]
) -> UnclosedConstruct:
    """Describe the mistake in an unclosed construct.

    :param construct: the text of the construct, up to the start of the next construct.
    :param start: the offset of the construct in the file.
    :param lines: the lines of the file.
    :param text: the text of the whole file.
    :param slots: the slot names of the known deftemplates, by deftemplate.
    """
    line = lines.line_at(start)
    beginning = _BEGINNING.match(construct)
    message = f"{' '.join(beginning.groups()) if beginning else 'this'} never closes"
    later_lines = enumerate(text.splitlines()[line:], line + 1)
    next_line = next(
        (number for number, text_line in later_lines if text_line.lstrip().startswith("(def")), 0
    )
    end = f"line {next_line}" if next_line else "the end of the file"
    quote_offset = _find_open_quote(text[start : lines.position(next_line) if next_line else len(text)])
    if quote_offset is not None:
        hint = f'a " is missing in line {lines.line_at(start + quote_offset)} or before {end}'
        return UnclosedConstruct(start + quote_offset, f"{message}: its string is open", hint)
    hint = f"a ) is missing before {end}"
    if list_offset := next(iter(find_unclosed_lists(construct, slots)), 0):  # 0 is the construct itself
        start += list_offset
        head = read_nodes(construct[list_offset:], close=True)[0].head
        message += f": its list ({head} is open" if head else ": a list in it is open"
        hint += f"; {beginning[1] if beginning else 'the construct'} begins in line {line}"
    return UnclosedConstruct(start, message, hint)


def _find_open_quote(construct: str) -> int | None:
    """Return the offset of the string that probably lacks its closing quote; None if all strings close."""
    strings = [match for match in HIDDEN.finditer(construct) if match[0].startswith('"')]
    if not any(match["unclosed"] for match in strings):
        return None
    # A string without its closing quote extends to the quote that opens the next string, usually in a later
    # line. Usually a word follows that quote directly, whereas a blank or a closing parenthesis follows a
    # closing quote.
    shifted_strings = (
        match
        for match in strings
        if "\n" in match[0] and construct[match.end() : match.end() + 1].strip(" \t\n)")
    )
    return next(shifted_strings, strings[-1]).start()
