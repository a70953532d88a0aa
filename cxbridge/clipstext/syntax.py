"""Parsing of CLIPS source text: tokens, nested lists with positions, and constructs.

Invalid text is accepted: a string without end extends to the end of the text, and superfluous closing
parentheses are ignored.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from functools import cached_property
from typing import Final

from msgspec import Struct

_STRING: Final = r'"[^"\\]*(?:\\.[^"\\]*)*"'
_UNCLOSED_STRING: Final = r'".*'
_COMMENT: Final = r";[^\n]*"

TOKEN: Final = re.compile(
    rf"""(?P<blank>\s+|{_COMMENT})"""
    r"""|(?P<word><[^\s()"&|~;<]*|[^\s()"&|~;<]+)|(?P<mark>[()&|~])"""
    rf"""|(?P<string>{_STRING})|(?P<unclosed>{_UNCLOSED_STRING})""",
    re.DOTALL | re.ASCII,  # CLIPS' blanks are ASCII: a no-break space belongs to a word
)
"""A token of CLIPS' scanner, with its kind as ``lastgroup``; comments are blank.

The tokens cover every character of a text.
"""

PARENTHESIS: Final = re.compile(r"[()]")
"""A parenthesis, for texts with blank strings and comments (:func:`blank`)."""

HIDDEN: Final = re.compile(rf"{_STRING}|(?P<unclosed>{_UNCLOSED_STRING})|{_COMMENT}", re.DOTALL)
"""A string or a comment, which is not code; the group ``unclosed`` is a string without end."""

CONSTRUCT: Final = re.compile(r"\(\s*(def[a-z]+)\s+([^\s()\";]+)", re.ASCII)
"""The start of a construct with kind and name, for texts with blank strings and comments.

The only construct that does not match is ``defmessage-handler``, whose kind has a hyphen.
"""

# The start of any construct.
_DEFINITION: Final = re.compile(r"\(\s*def[a-z-]+\s")

# A deffunction without actions, for texts with blank strings and comments.
_DECLARATION: Final = re.compile(r"\(\s*deffunction\s[^()]*\([^()]*\)\s*\)")

_CHARACTER_IN_LINE: Final = re.compile(r"[^\n]")


class SyntaxNode(Struct, frozen=True):
    """A word, a string, one of the marks ``& | ~``, or a list of nodes in parentheses.

    :param source: the parsed text.
    :param start: the position in the source.
    :param end: the position after the node.
    :param items: the nodes of a list, otherwise None.
    """

    source: str
    start: int
    end: int
    items: tuple[SyntaxNode, ...] | None = None

    @property
    def text(self) -> str:
        """The source text including comments."""
        # not stored, because that would take the length of the text times its depth
        return self.source[self.start : self.end]

    @property
    def head(self) -> str:
        """The first word of a list, or empty."""
        return self.items[0].text if self.items and self.items[0].items is None else ""

    @property
    def arguments(self) -> tuple[SyntaxNode, ...]:
        """The nodes of a list after the first."""
        return (self.items or ())[1:]

    def walk(self) -> Iterator[SyntaxNode]:
        """Yield the node and its descendants in the order of the text."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack += reversed(node.items or ())


class Lines(Struct, frozen=True, dict=True):
    """The lines of a text."""

    text: str

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer("\n", self.text))]

    def line_at(self, position: int) -> int:
        """Return the line of a position, from 1."""
        return bisect_right(self._starts, position)

    def column_at(self, position: int) -> int:
        """Return the column of a position, from 1."""
        return position - self._starts[self.line_at(position) - 1] + 1

    def position(self, line: int, column: int = 1) -> int:
        """Return the position of a line and column, both from 1; the end of the text for a later line."""
        return self._starts[line - 1] + column - 1 if line <= len(self._starts) else len(self.text)


def read_nodes(text: str, *, close: bool = False) -> list[SyntaxNode]:
    """Return the top-level nodes of ``text``.

    :param close: whether lists without end extend to the end of the text; otherwise they are left out.
    """
    stack: list[tuple[int, list[SyntaxNode]]] = [(0, [])]
    for match in TOKEN.finditer(text):
        if match.lastgroup == "blank":
            continue
        token = match.group()
        if token == "(":
            stack.append((match.start(), []))
        elif token != ")":
            stack[-1][1].append(SyntaxNode(text, match.start(), match.end()))
        elif len(stack) > 1:
            start, items = stack.pop()
            stack[-1][1].append(SyntaxNode(text, start, match.end(), tuple(items)))
    while close and len(stack) > 1:
        start, items = stack.pop()
        stack[-1][1].append(SyntaxNode(text, start, len(text), tuple(items)))
    return stack[0][1]


def compact(text: str) -> str:
    """Return CLIPS text without comments, line ends and superfluous blanks outside strings."""
    tokens: list[str] = []
    for match in TOKEN.finditer(text):
        token = " " if match.lastgroup == "blank" else match.group()
        # no blank after an opening or before a closing parenthesis
        if token == " " and (not tokens or tokens[-1] in (" ", "(")):
            continue
        if token == ")" and tokens and tokens[-1] == " ":
            tokens.pop()
        tokens.append(token)
    return "".join(tokens).strip()


def blank(text: str) -> str:
    """Return a text with blanks instead of strings and comments, so that only code is left.

    Positions and line ends are unchanged.
    """
    return HIDDEN.sub(_blank_match, text)


def _blank_match(match: re.Match[str]) -> str:
    hidden = match.group()
    return _CHARACTER_IN_LINE.sub(" ", hidden) if "\n" in hidden else " " * len(hidden)


def top_level_lists(code: str) -> Iterator[tuple[int, int | None]]:
    """Yield start and end of each top-level list; None is the end of a list without end.

    The function is much faster than :func:`read_nodes`, because it makes no nodes.

    :param code: a text with blank strings and comments.
    """
    depth = start = 0
    for match in PARENTHESIS.finditer(code):
        if match.group() == "(":
            if depth == 0:
                start = match.start()
            depth += 1
        elif depth > 0:
            depth -= 1
            if depth == 0:
                yield start, match.end()
    if depth > 0:
        yield start, None


def has_top_level_calls(text: str) -> bool:
    """Return whether a file has calls at the top level, so that CLIPS executes it with ``batch``."""
    code = blank(text)
    return any(not _DEFINITION.match(code, start) for start, _ in top_level_lists(code))


def literal(node: SyntaxNode) -> str:
    """Return the text of a literal word or string; empty for other nodes."""
    # neither a variable nor a mark of a constraint
    if node.items is not None or node.text.startswith(("?", "$?")) or node.text in "&|~:=":
        return ""
    return node.text.strip('"') if node.text.startswith('"') else node.text


def without_module(name: str) -> str:
    """Return the name of a construct without its module: ``a`` for ``MAIN::a``."""
    return name.rpartition("::")[2]


def is_declaration(construct: str) -> bool:
    """Return whether a construct is a deffunction without actions, which declares a function."""
    return _DECLARATION.fullmatch(blank(construct)) is not None


class Definition(Struct, frozen=True):
    """A definition: a top-level list with a name, usually a construct.

    :param kind: the first word of the list: ``defrule``, ``deftemplate`` ...
    :param name: the second word or node, without the module of a name.
    :param line: the line on which the list begins, from 1.
    :param node: the whole list.
    """

    kind: str
    name: str
    line: int
    node: SyntaxNode


def definitions(text: str) -> Iterator[Definition]:
    """Yield the definitions of a file in order, without unclosed lists and lists of a single node."""
    lines = Lines(text)
    for node in read_nodes(text):
        if node.arguments:
            name = without_module(node.arguments[0].text)
            yield Definition(node.head, name, lines.line_at(node.start), node)


def rule_lines(text: str) -> dict[str, int]:
    """Return the line of each rule of a file by name; the last of several rules with the same name counts."""
    code, lines = blank(text), Lines(text)
    constructs = ((CONSTRUCT.match(code, start), start) for start, _ in top_level_lists(code))
    return {
        without_module(match[2]): lines.line_at(start)
        for match, start in constructs
        if match and match[1] == "defrule"
    }
