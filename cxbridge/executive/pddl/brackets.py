"""Reads PDDL text as nested lists of words, the lexical layer of PDDL.

PDDL's meaning is not in its brackets: which keyword may stand where is decided in :mod:`.domains` and
:mod:`.formulas`, which can say better than a grammar of brackets what is wrong. Depth is
bounded, so that no text can exhaust the stack.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error

MAX_DEPTH: Final = 100
_SECTION_DEPTH: Final = 2  # (define (:section

_TOKEN: Final = re.compile(r"[()]|;[^\n]*|[^\s();]+")


class BracketWord(NamedTuple):
    """A word: anything between blanks and brackets."""

    text: str
    position: Position


class Group(NamedTuple):
    """A bracketed list."""

    items: tuple[BracketWord | Group, ...]
    position: Position

    @property
    def head(self) -> str:
        """The first word; empty when there is none."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, BracketWord) else ""


Item = BracketWord | Group


def read_items(text: str, file: str = "", *, close_last: bool = False) -> tuple[Item, ...]:
    """Return the words and groups of a text.

    :param close_last: whether the very last bracket may be missing.
    :raises PddlSyntaxError: when brackets do not match or are nested deeper than :data:`MAX_DEPTH`.
    """
    _check_depth(text, file)
    items: list[Item] = []
    opened: list[tuple[list[Item], Position]] = []
    for token, position in _tokens(text):
        if token == "(":
            opened.append((items, position))
            items = []
        elif token != ")":
            items.append(BracketWord(token, position))
        elif opened:
            outer, start = opened.pop()
            outer.append(Group(tuple(items), start))
            items = outer
        else:
            raise syntax_error("there is a ')' too many", position, file)
    if not opened:
        return tuple(items)
    if close_last:
        return read_items(f"{text}\n)", file)
    raise _unclosed(text, file)


def _tokens(text: str) -> Iterator[tuple[str, Position]]:
    """Yield brackets and words, and where they stand."""
    line, line_start, counted = 1, 0, 0
    for match in _TOKEN.finditer(text):
        token, at = match[0], match.start()
        if token[0] == ";":
            continue
        newlines = text.count("\n", counted, at)
        if newlines:
            line += newlines
            line_start = text.rfind("\n", counted, at) + 1
        counted = at
        yield token, Position(line, at - line_start + 1)


def _check_depth(text: str, file: str) -> None:
    """Refuse what is nested too deep for those who walk the items, and do so before any work is done."""
    depth = 0
    for match in _TOKEN.finditer(text):
        depth += {"(": 1, ")": -1}.get(match[0], 0)
        if depth > MAX_DEPTH:
            place = match.start()
            position = Position(text.count("\n", 0, place) + 1, place - text.rfind("\n", 0, place))
            raise syntax_error(f"brackets are nested more than {MAX_DEPTH} deep", position, file)


def _unclosed(text: str, file: str) -> PddlSyntaxError:
    """Return the error for a text that ends inside a bracket, with the place of the missing one."""
    opened: list[Position] = []
    after_open = False
    for token, position in _tokens(text):
        if token == "(":
            opened.append(position)
        elif token == ")":
            opened.pop()
        elif after_open and token.startswith(":") and len(opened) > _SECTION_DEPTH:
            return syntax_error(f"a ')' is missing before '({token}'", opened[-1], file)
        after_open = token == "("
    return syntax_error("this '(' is never closed", opened[-1], file)
