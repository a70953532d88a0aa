"""Insertion of values into Lua code: lexical context and escaping."""

from __future__ import annotations

import re
from enum import Enum

_ESCAPES = {"\\": "\\\\", '"': '\\"', "'": "\\'", "\n": "\\n", "\r": "\\r", "\0": "\\000"}
_WORD = re.compile(r"[A-Za-z0-9_.+-]+")
# a long bracket (of a string or a comment), a comment up to its line end, a quote, or any other character
_TOKEN = re.compile(
    r"""(?P<long>(?:--)?\[(?P<level>=*)\[)
      | (?P<comment>--[^\n]*)
      | (?P<quote>["'])
      | .""",
    re.VERBOSE | re.DOTALL,
)
_INSIDE_QUOTES = {quote: re.compile(rf"(?:\\.|[^\\{quote}])*", re.DOTALL) for quote in "\"'"}


class QuotingContext(Enum):
    """The lexical context at the end of Lua code."""

    CODE = "code"
    DOUBLE_QUOTES = '"'
    SINGLE_QUOTES = "'"
    ESCAPE = "an escape sequence"
    OTHER = "a comment or a long bracket"


def escape(value: str, quote: str = '"') -> str:
    r"""Escape a value for a Lua string in quotes.

    The quote, ``\``, line ends and NUL are escaped.
    """
    other_quote = "'" if quote == '"' else '"'
    return "".join(char if char == other_quote else _ESCAPES.get(char, char) for char in value)


def is_word(value: str) -> bool:
    """Return whether a value is a single word or number: letters, digits, ``_ . + -``, without ``--``."""
    return _WORD.fullmatch(value) is not None and "--" not in value


def makes_comment(prefix: str, suffix: str) -> bool:
    """Return whether two parts form the comment mark ``--`` only when they are joined."""
    return prefix.endswith("-") and suffix.startswith("-") and context_at_end(prefix) is QuotingContext.CODE


def context_at_end(code: str) -> QuotingContext:
    """Return the lexical context at the end of Lua code."""
    position = 0
    while position < len(code):
        token = _TOKEN.match(code, position)
        assert token is not None  # the last alternative matches any character
        position = token.end()
        if token["quote"]:
            inside = _INSIDE_QUOTES[token["quote"]].match(code, position)
            assert inside is not None  # the pattern matches an empty text, too
            position = inside.end()
            # the code ends within the quotes, where a value will be inserted
            if position == len(code):
                return QuotingContext(token["quote"])
            # a backslash without the character that it escapes
            if code[position] == "\\":
                return QuotingContext.ESCAPE
            position += 1
        elif token["long"]:
            closing = code.find(f"]{token['level']}]", position)
            if closing < 0:
                return QuotingContext.OTHER
            position = closing + len(token["level"]) + 2
        # a comment ends at its line end, so only a comment at the end of the code is the context
        elif token["comment"] and position == len(code):
            return QuotingContext.OTHER
    return QuotingContext.CODE
