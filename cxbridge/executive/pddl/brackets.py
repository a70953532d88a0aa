"""PDDL text to nested lists of words: the lexical layer, an LALR grammar for lark.

PDDL's meaning is not in its brackets: which keyword may stand where is decided in :mod:`.domains` and
:mod:`.formulas`, which can say better than a table of tokens what is wrong. Depth is
bounded, so that no text can exhaust the stack.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any, Final, NamedTuple

from lark import Lark, Token, Transformer, UnexpectedInput, UnexpectedToken

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error

MAX_DEPTH: Final = 100
_SECTION_DEPTH: Final = 2  # (define (:section

_BRACKETS: Final = re.compile(r"[()]|;[^\n]*")
_GRAMMAR: Final = r"""
    text: item*
    ?item: WORD -> word
         | OPEN item* CLOSE -> group
    OPEN: "("
    CLOSE: ")"
    WORD: /[^\s();]+/
    %ignore /\s+/
    %ignore /;[^\n]*/
"""


class Word(NamedTuple):
    """A word: anything between blanks and brackets."""

    text: str
    position: Position


class Group(NamedTuple):
    """A bracketed list."""

    items: tuple[Word | Group, ...]
    position: Position

    @property
    def head(self) -> str:
        """The first word; empty when there is none."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, Word) else ""


Item = Word | Group


class _Builder(Transformer[Token, tuple[Item, ...]]):
    """Makes items as the parser reduces."""

    def text(self, items: list[Item]) -> tuple[Item, ...]:
        return tuple(items)

    def word(self, tokens: list[Token]) -> Word:
        return Word(str(tokens[0]), _position(tokens[0]))

    def group(self, items: list[Any]) -> Group:
        return Group(tuple(items[1:-1]), _position(items[0]))


def _position(token: Token) -> Position:
    return Position(token.line or 1, token.column or 1)


@cache
def _parser() -> Lark:
    return Lark(_GRAMMAR, start="text", parser="lalr", transformer=_Builder())


def read_items(text: str, file: str = "", *, close_last: bool = False) -> tuple[Item, ...]:
    """Return the words and groups of a text.

    :param close_last: whether the very last bracket may be missing.
    :raises PddlSyntaxError: when brackets do not match or are nested deeper than :data:`MAX_DEPTH`.
    """
    _check_depth(text, file)
    try:
        items: Any = _parser().parse(text)
    except UnexpectedInput as error:
        problem = _bracket_error(text, error, file)
        if close_last and isinstance(error, UnexpectedToken) and error.token.type == "$END":
            return read_items(f"{text}\n)", file)
        raise problem from None
    return tuple(items)


def _check_depth(text: str, file: str) -> None:
    """Refuse what is nested too deep for those who walk the items, and do so before any work is done."""
    depth = 0
    for match in _BRACKETS.finditer(text):
        depth += {"(": 1, ")": -1}.get(match[0], 0)
        if depth > MAX_DEPTH:
            place = match.start()
            position = Position(text.count("\n", 0, place) + 1, place - text.rfind("\n", 0, place))
            raise syntax_error(f"brackets are nested more than {MAX_DEPTH} deep", position, file)


def _bracket_error(text: str, error: UnexpectedInput, file: str) -> PddlSyntaxError:
    if isinstance(error, UnexpectedToken) and error.token.type == "CLOSE":
        return syntax_error("there is a ')' too many", _position(error.token), file)
    opened: list[Token] = []
    after_open = False
    for token in _parser().lex(text):
        if token.type == "OPEN":
            opened.append(token)
        elif token.type == "CLOSE":
            opened.pop()
        elif after_open and token.startswith(":") and len(opened) > _SECTION_DEPTH:
            return syntax_error(f"a ')' is missing before '({token}'", _position(opened[-1]), file)
        after_open = token.type == "OPEN"
    return syntax_error("this '(' is never closed", _position(opened[-1]), file)
