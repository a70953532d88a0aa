"""The words and bracketed groups of a text, whether or not the text is valid PDDL.

Editors need them for texts that are not yet valid PDDL, and error messages for the context of an error. Only
the brackets must match.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.grammar import END_TERMINAL
from cxbridge.executive.pddl.tokens import SourceText, Token

SECTION_DEPTH: Final = 2  # the number of open brackets within a section: (define (:section
_WORD: Final = re.compile(r"\S+")


class BracketWord(NamedTuple):
    """A sequence of characters between blanks and brackets."""

    text: str
    position: Position


class Group(NamedTuple):
    """A bracketed list.

    :param position: the position of the opening bracket.
    :param end: the position of the closing bracket.
    """

    items: tuple[BracketWord | Group, ...]
    position: Position
    end: Position

    @property
    def head(self) -> str:
        """The first word; empty if the group is empty or starts with a group."""
        item = self.items[0] if self.items else None
        return item.text if isinstance(item, BracketWord) else ""


Item = BracketWord | Group


def read_items(text: str, file: str = "") -> tuple[Item, ...]:
    """Return the words and groups of a text.

    :raises PddlSyntaxError: if brackets do not match or are nested too deeply.
    """
    return parse_items(SourceText(text, file))


def parse_items(text: SourceText) -> tuple[Item, ...]:
    """Return the words and groups of tokens.

    :raises PddlSyntaxError: if brackets do not match.
    """
    items: list[Item] = []
    # for each open bracket, outermost first: the items before the bracket in its group, and its position
    open_groups: list[tuple[list[Item], Position]] = []
    for token in text.tokens:
        position = text.position(token.start)
        if token.text == "(":
            open_groups.append((items, position))
            items = []
        elif token.text != ")":
            items += token_words(token, text)
        elif open_groups:
            outer_items, start = open_groups.pop()
            outer_items.append(Group(tuple(items), start, position))
            items = outer_items
        else:
            raise syntax_error("there is one ')' too many", position, text.file)
    if open_groups:
        raise _unclosed_error(text)
    return tuple(items)


def token_words(token: Token, text: SourceText) -> list[BracketWord]:
    """Return the words of a token. The token ``at start`` has two words, the end of the text none."""
    return [
        BracketWord(match[0], text.position(token.start + match.start()))
        for match in _WORD.finditer(token.text)
    ]


def _unclosed_error(text: SourceText) -> PddlSyntaxError:
    """Return the error about a missing closing bracket, at its probable place."""
    # a section within another section shows that the innermost open group lacks its bracket
    open_positions: list[Position] = []
    follows_bracket = False
    for token in text.tokens:
        if token.text == "(":
            open_positions.append(text.position(token.start))
        elif token.text == ")":
            open_positions.pop()
        elif follows_bracket and token.text.startswith(":") and len(open_positions) > SECTION_DEPTH:
            return syntax_error(f"a ')' is missing before '({token.text}'", open_positions[-1], text.file)
        elif token.kind == END_TERMINAL:
            break
        follows_bracket = token.text == "("
    return syntax_error("this '(' is never closed", open_positions[-1], text.file)
