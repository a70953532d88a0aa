"""The tokens of PDDL: brackets and words, with their terminals in the grammar.

The text is cut into words at blanks and brackets. The spelling of a word then decides its terminal. A keyword
is a name wherever the grammar permits no keyword. Four terminals do not end at blanks, and are cut before
words: ``at start``, ``at end``, ``over all``, and the dash of a type in ``?x -robot``.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cache, lru_cache
from itertools import accumulate, repeat
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.errors import syntax_error
from cxbridge.executive.pddl.grammar import END_TERMINAL, load_tables

MAX_DEPTH: Final = 100
"""The maximum nesting of brackets: functions on formulas are recursive, and Python's stack is limited."""

MAX_WORD_LENGTH: Final = 1000
"""The maximum length of a word, chosen freely: hostile texts may contain huge words."""

_DEPTH_CHANGES: Final = {"(": 1, ")": -1}


class Token(NamedTuple):
    """A word or a bracket.

    :param kind: the terminal.
    :param start: the offset in the text, from 0.
    """

    kind: str
    text: str
    start: int


class SourceText:
    """A text with its tokens.

    :param file: the file name for errors.
    :ivar tokens: the tokens, with the terminal ``END_TERMINAL`` at the end.
    :ivar kinds: the terminals of the words in the text, by word.
    :raises PddlSyntaxError: if brackets exceed :data:`MAX_DEPTH`, or a word :data:`MAX_WORD_LENGTH`.
    """

    def __init__(self, text: str, file: str = "") -> None:
        self.file = file
        self.length = len(text)
        self.kinds = _WordKinds()
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.tokens = self._read_tokens(text)

    def position(self, start: int) -> Position:
        """Return line and column of an offset."""
        line = bisect_right(self._line_starts, start)
        return Position(line, start - self._line_starts[line - 1] + 1)

    def _read_tokens(self, text: str) -> list[Token]:
        text = blank_comments(text)
        kinds, make_tuple = self.kinds, tuple.__new__  # twice as fast as a call of Token
        # a group of the pattern has the name of its terminal; other matches are words
        tokens: list[Token] = [
            make_tuple(Token, (match.lastgroup or kinds[match[0]], match[0], match.start()))
            for match in _load_token_pattern().finditer(text)
        ]
        # the depth after each token; words do not change the depth
        depths = accumulate(map(_DEPTH_CHANGES.get, [word for _, word, _ in tokens], repeat(0)))
        if max(depths, default=0) > MAX_DEPTH or max(map(len, kinds), default=0) > MAX_WORD_LENGTH:
            self._refuse_excess(tokens)
        tokens.append(Token(END_TERMINAL, "", len(text)))
        return tokens

    def _refuse_excess(self, tokens: list[Token]) -> None:
        """Raise the error about the first token that is nested too deeply or too long."""
        depth = 0
        for _, word, start in tokens:
            depth += _DEPTH_CHANGES.get(word, 0)
            message = f"brackets are nested more than {MAX_DEPTH} deep" if depth > MAX_DEPTH else ""
            if len(word) > MAX_WORD_LENGTH:
                message = f"a word has more than {MAX_WORD_LENGTH} characters"
            if message:
                raise syntax_error(message, self.position(start), self.file)


class _WordKinds(dict[str, str]):
    """The terminals of a text's words, computed once per word."""

    def __missing__(self, word: str) -> str:
        kind = self[word] = _find_word_kind(word)
        return kind


@lru_cache(maxsize=4096)
def _find_word_kind(word: str) -> str:
    # cached across texts: a domain and its problems share most words; the size bounds the memory
    keywords, words = _load_word_tables()
    kind = keywords.get(word.lower())
    if kind is None:
        match = words.fullmatch(word)
        kind = match and match.lastgroup
    assert kind is not None  # ODD, the last pattern, matches every word
    return kind


@cache
def _load_word_tables() -> tuple[dict[str, str], re.Pattern[str]]:
    """Return the terminals by keyword, and a pattern for other words with terminals as group names."""
    tables = load_tables()
    patterns = (f"(?P<{name}>{pattern})" for name, pattern in tables.words.items())
    return tables.keywords, re.compile("|".join(patterns), re.ASCII)


@cache
def _load_token_pattern() -> re.Pattern[str]:
    tables = load_tables()
    cuts = "|".join(f"(?P<{name}>{pattern})" for name, pattern in tables.cuts.items())
    # brackets and variables first: they are most frequent and cannot be confused with other tokens
    return re.compile(rf"[()]|{tables.words['VARIABLE']}|{cuts}|{tables.words['ODD']}")


def blank_comments(text: str) -> str:
    """Return a text with blanks in place of comments, which keeps the positions of all words."""
    return re.sub(load_tables().comment, lambda match: " " * len(match[0]), text)
