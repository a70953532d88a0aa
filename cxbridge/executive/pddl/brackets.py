"""The nesting of brackets in a text, whether or not the text is valid PDDL.

Editors use it for unfinished texts, and error messages for the context of an error.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.grammar import END
from cxbridge.executive.pddl.tokens import Text, Token

_SECTION_DEPTH: Final = 2  # (define (:section
_WORD: Final = re.compile(r"\S+")


class BracketWord(NamedTuple):
    """A sequence of characters between blanks and brackets."""

    text: str
    position: Position


class Group(NamedTuple):
    """A bracketed list.

    :param end: the position of the closing bracket.
    """

    items: tuple[BracketWord | Group, ...]
    position: Position
    end: Position

    @property
    def head(self) -> str:
        """The first word; empty without one."""
        item = self.items[0] if self.items else None
        return item.text if isinstance(item, BracketWord) else ""


Item = BracketWord | Group


def read_items(text: str, file: str = "") -> tuple[Item, ...]:
    """Return the words and groups of a text.

    :raises PddlSyntaxError: if brackets do not match or are nested too deeply.
    """
    return items_of(Text(text, file))


def items_of(text: Text) -> tuple[Item, ...]:
    """Return the words and groups of tokens.

    :raises PddlSyntaxError: if brackets do not match.
    """
    items: list[Item] = []
    opened: list[tuple[list[Item], Position]] = []
    for token in text.tokens:
        position = text.position(token.start)
        if token.text == "(":
            opened.append((items, position))
            items = []
        elif token.text != ")":
            items += words_of(token, text)
        elif opened:
            outer, start = opened.pop()
            outer.append(Group(tuple(items), start, position))
            items = outer
        else:
            raise syntax_error("there is a ')' too many", position, text.file)
    if opened:
        raise _unclosed(text)
    return tuple(items)


def words_of(token: Token, text: Text) -> list[BracketWord]:
    """Return the words of a token: two for ``at start``, none for the end of the text."""
    return [
        BracketWord(match[0], text.position(token.start + match.start()))
        for match in _WORD.finditer(token.text)
    ]


def _unclosed(text: Text) -> PddlSyntaxError:
    """Return the error at the probable place of a missing bracket."""
    # a section within another one shows where a bracket is missing: at the innermost open group
    opened: list[Position] = []
    after_open = False
    for token in text.tokens:
        if token.text == "(":
            opened.append(text.position(token.start))
        elif token.text == ")":
            opened.pop()
        elif after_open and token.text.startswith(":") and len(opened) > _SECTION_DEPTH:
            return syntax_error(f"a ')' is missing before '({token.text}'", opened[-1], text.file)
        elif token.kind == END:
            break
        after_open = token.text == "("
    return syntax_error("this '(' is never closed", opened[-1], text.file)
