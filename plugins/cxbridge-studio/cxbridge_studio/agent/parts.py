"""Cuts CLIPS text into its top-level lists, broken text too: a mistake in one construct loses no other."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, PARENTHESIS, blank, top_level

_BEGIN: Final = re.compile(
    r"^[ \t]*(\((?:def(?:rule|template|facts|function|global|generic|method|class|module|instances|"
    r"message-handler))(?=[\s(]))",
    re.MULTILINE,
)
"""A line that begins a construct: none is ever inside of another one."""


class Part(Struct, frozen=True):
    """A list at the top level of a text.

    :param start: where it begins.
    :param text: the source text; of a list that never closes, the text before the next construct.
    :param closed: whether it closes.
    """

    start: int
    text: str
    closed: bool


def parts(text: str) -> tuple[Part, ...]:
    """Return the lists at the top level of a text, in their order.

    Where parentheses or quotes do not match, each line that begins a construct begins a new part.
    """
    code = blank(text)
    found = [Part(start, text[start:end], end is not None) for start, end in top_level(code)]
    if _is_clean(text, code, found):
        return tuple(found)
    return tuple(_cut(text))


def _is_clean(text: str, code: str, found: list[Part]) -> bool:
    """Whether everything closes, and no construct begins within another one."""
    if any(not part.closed for part in found) or code.count("(") != code.count(")"):
        return False
    starts = {part.start for part in found}
    if any(match.start(1) not in starts for match in _BEGIN.finditer(code)):
        return False
    return not any(match["unclosed"] for match in HIDDEN.finditer(text))


def _cut(text: str) -> Iterator[Part]:
    """Yield the parts of a text that is broken."""
    begins = [match.start(1) for match in _BEGIN.finditer(text)]
    edges = [0, *begins, len(text)]
    for begin, end in pairwise(edges):
        yield from _parts_of(text, begin, end)


def _parts_of(text: str, begin: int, end: int) -> Iterator[Part]:
    code = blank(text[begin:end])
    for start, stop in top_level(code):
        last = len(code.rstrip()) if stop is None else stop
        yield Part(begin + start, text[begin + start : begin + last], stop is not None)


def open_lists(part: str) -> list[int]:
    """Return where the lists begin that never close, the outermost first."""
    opened: list[int] = []
    for match in PARENTHESIS.finditer(blank(part)):
        if match[0] == "(":
            opened.append(match.start())
        elif opened:
            opened.pop()
    return opened
