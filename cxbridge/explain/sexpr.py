"""CLIPS text as nested lists, each node with its place: as much of a parser as explaining needs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_TOKEN = re.compile(
    r"""(?P<blank>\s+|;[^\n]*)|(?P<string>"(?:[^"\\]|\\.)*(?:"|\Z))|(?P<mark>[()&|~])"""
    r"""|(?P<atom><[^\s()"&|~;<]*|[^\s()"&|~;<]+)""",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Node:
    """A word, a string, one of the marks ``& | ~``, or a list of nodes in parentheses.

    :param source: the text that was read.
    :param start: where it begins in that.
    :param end: where it ends.
    :param items: the nodes of a list; None for anything else.
    """

    source: str
    start: int
    end: int
    items: tuple[Node, ...] | None = None

    @property
    def text(self) -> str:
        """As it is written, comments included. Not kept: that would be the depth times the length of all."""
        return self.source[self.start : self.end]

    @property
    def head(self) -> str:
        """The first word of a list; empty when there is none."""
        return self.items[0].text if self.items and self.items[0].items is None else ""

    def walk(self) -> Iterator[Node]:
        """Yield the node and all nodes in it, in the order of the text."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack += reversed(node.items or ())


def read(text: str) -> list[Node]:
    """Return the nodes at the top level of ``text``. What stands in a list that never closes is left out."""
    stack: list[tuple[int, list[Node]]] = [(0, [])]
    for match in _TOKEN.finditer(text):
        token, at = match.group(), match.start()
        if match.lastgroup == "blank":
            continue
        if token == "(":
            stack.append((at, []))
        elif token != ")":
            stack[-1][1].append(Node(text, at, match.end()))
        elif len(stack) > 1:
            start, items = stack.pop()
            stack[-1][1].append(Node(text, start, match.end(), tuple(items)))
    return stack[0][1]


def one_line(text: str) -> str:
    """Return CLIPS text on one line: without comments, each run of blanks as one, none inside parentheses."""
    parts: list[str] = []
    for match in _TOKEN.finditer(text):
        token = " " if match.lastgroup == "blank" else match.group()
        if token == " " and (not parts or parts[-1] in (" ", "(")):
            continue
        if token == ")" and parts and parts[-1] == " ":
            parts.pop()
        parts.append(token)
    return "".join(parts).strip()
