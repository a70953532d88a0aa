"""Reads the words and the tables in a Lua text, without executing the text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

# Comments and strings may have long brackets, such as [[...]] or [==[...]==]: both brackets of a pair have
# the same number of =. Without its closing bracket, a comment or string extends to the end of the text.
_TOKEN: Final = re.compile(
    r"""(?P<comment>--\[(?P<comment_level>=*)\[.*?(?:\](?P=comment_level)\]|\Z)|--[^\n]*)
    |(?P<string>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'
        |\[(?P<string_level>=*)\[.*?(?:\](?P=string_level)\]|\Z))
    |(?P<name>[A-Za-z_]\w*)
    |(?P<number>\.?\d[\w.]*)
    |(?P<sign>\.{2,3}|[=~<>]=|\S)""",
    re.DOTALL | re.VERBOSE,
)
# The block of a `for` or `while` begins with its `do`.
_BLOCK_STARTS: Final = frozenset({"function", "if", "do", "repeat"})
_BLOCK_ENDS: Final = frozenset({"end", "until"})


@dataclass(frozen=True, slots=True)
class Token:
    """A word, literal or sign.

    :param kind: string, name, number or sign.
    :param offset: the position in the text, from 0.
    :param depth: the number of brackets and blocks around the token.
    """

    kind: str
    text: str
    offset: int
    depth: int = 0

    @property
    def literal(self) -> str | None:
        """The value of a string in quotes without escapes; None for any other token."""
        is_literal = self.kind == "string" and self.text[0] != "[" and "\\" not in self.text
        return self.text[1:-1] if is_literal else None


@dataclass(frozen=True, slots=True)
class Table:
    """A table constructor.

    Values with a computed key, ``[EXPRESSION] = VALUE``, are left out.

    :param items: the tokens of each value without a key.
    :param fields: the tokens of each value with a name as its key.
    """

    items: list[Sequence[Token]] = field(default_factory=list)
    fields: dict[str, Sequence[Token]] = field(default_factory=dict)


def read_tokens(text: str) -> list[Token]:
    """Return the tokens of a Lua text without its comments."""
    tokens: list[Token] = []
    depth = 0
    for match in _TOKEN.finditer(text):
        kind = "string" if match["string"] else match.lastgroup or "sign"
        if match["comment"]:
            continue
        word = match[0]
        if kind != "string" and (word in _BLOCK_ENDS or word in ")}]"):
            depth -= 1
        tokens.append(Token(kind, word, match.start(), depth))
        if kind != "string" and (word in _BLOCK_STARTS or word in "({["):
            depth += 1
    return tokens


def read_table(tokens: Sequence[Token]) -> Table | None:
    """Return the table that the tokens begin with; None if they begin with no closed table."""
    if not tokens or tokens[0].text != "{":
        return None
    outer_depth = tokens[0].depth
    table = Table()
    value_tokens: list[Token] = []
    for token in tokens[1:]:
        is_end = token.text == "}" and token.depth == outer_depth
        if not is_end and not (token.text in {",", ";"} and token.depth == outer_depth + 1):
            value_tokens.append(token)
            continue
        if len(value_tokens) > 1 and value_tokens[0].kind == "name" and value_tokens[1].text == "=":
            table.fields[value_tokens[0].text] = value_tokens[2:]
        elif value_tokens and value_tokens[0].text != "[":  # not a computed key
            table.items.append(value_tokens)
        value_tokens = []
        if is_end:
            return table
    return None
