"""The tokens of PDDL: brackets and words, with their terminals in the grammar.

Words are cut at blanks and brackets first, and then classified: a keyword is a name wherever it cannot be a
keyword, which the grammar decides. Only ``at start`` and the dash of a type are cut out before.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cache, lru_cache
from itertools import accumulate, repeat
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import syntax_error
from cxbridge.executive.pddl.grammar import END, load_tables

MAX_DEPTH: Final = 100
"""The maximum nesting of brackets, because functions on formulas are recursive."""

MAX_WORD: Final = 1000
"""The maximum length of a word."""

_DEEPER: Final = {"(": 1, ")": -1}


class Token(NamedTuple):
    """A word or a bracket.

    :param kind: the terminal.
    :param start: the offset in the text, from 0.
    """

    kind: str
    text: str
    start: int


class Text:
    """A tokenised text.

    :param file: the file name for errors.
    :raises PddlSyntaxError: if brackets exceed :data:`MAX_DEPTH`, or a word :data:`MAX_WORD`.
    """

    def __init__(self, text: str, file: str = "") -> None:
        self.file = file
        self.length = len(text)
        self.kinds = _Kinds()
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.tokens = self._tokens(text)

    def position(self, start: int) -> Position:
        """Return line and column of an offset."""
        line = bisect_right(self._line_starts, start)
        return Position(line, start - self._line_starts[line - 1] + 1)

    def _tokens(self, text: str) -> list[Token]:
        comment, pattern = _patterns()
        if ";" in text:  # blanks of the same length keep the positions
            text = comment.sub(lambda match: " " * len(match[0]), text)
        kinds, make = self.kinds, tuple.__new__  # takes half the time of a call of Token
        tokens: list[Token] = [
            make(Token, (match.lastgroup or kinds[match[0]], match[0], match.start()))
            for match in pattern.finditer(text)
        ]
        depths = accumulate(map(_DEEPER.get, [token[1] for token in tokens], repeat(0)))
        if max(depths, default=0) > MAX_DEPTH or max(map(len, kinds), default=0) > MAX_WORD:
            self._refuse(tokens)
        tokens.append(Token(END, "", len(text)))
        return tokens

    def _refuse(self, tokens: list[Token]) -> None:
        """Raise the error about the first token that is nested too deeply or too long."""
        depth = 0
        for _, word, start in tokens:
            depth += _DEEPER.get(word, 0)
            message = f"brackets are nested more than {MAX_DEPTH} deep" if depth > MAX_DEPTH else ""
            if len(word) > MAX_WORD:
                message = f"a word has more than {MAX_WORD} characters"
            if message:
                raise syntax_error(message, self.position(start), self.file)


class _Kinds(dict[str, str]):
    """The terminals of a text's words, computed once per word."""

    def __missing__(self, word: str) -> str:
        kind = self[word] = _kind(word)
        return kind


@lru_cache(maxsize=4096)
def _kind(word: str) -> str:
    # cached across texts: a domain and its problems share most words
    keywords, words = _words()
    kind = keywords.get(word.lower())
    if kind is None:
        match = words.fullmatch(word)
        kind = match and match.lastgroup
    assert kind is not None  # ODD, the last pattern, matches every word
    return kind


@cache
def _words() -> tuple[dict[str, str], re.Pattern[str]]:
    """Return terminals by keyword, and a pattern of other words with terminals as group names."""
    tables = load_tables()
    patterns = (f"(?P<{name}>{pattern})" for name, pattern in tables.words.items())
    return tables.keywords, re.compile("|".join(patterns), re.ASCII)


@cache
def _patterns() -> tuple[re.Pattern[str], re.Pattern[str]]:
    """Return the patterns of comments and of tokens."""
    tables = load_tables()
    cuts = "|".join(f"(?P<{name}>{pattern})" for name, pattern in tables.cuts.items())
    return re.compile(tables.comment), re.compile(
        # brackets and variables first: they are most frequent and cannot be confused with other tokens
        rf"[()]|{tables.words['VARIABLE']}|{cuts}|{tables.words['ODD']}"
    )
