"""Splits CLIPS text into top-level lists. An error in one construct leaves other constructs intact."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, PARENTHESIS, blank, top_level

# A line that begins a construct: CLIPS has no nested constructs.
_BEGIN: Final = re.compile(
    r"^[ \t]*(\((?:def(?:rule|template|facts|function|global|generic|method|class|module|instances|"
    r"message-handler))(?=[\s(]))",
    re.MULTILINE,
)


class TopLevelList(Struct, frozen=True):
    """A top-level list of a text.

    :param start: offset of its first character.
    :param text: the source text; an unclosed list ends before the next construct.
    :param closed: whether the list is closed.
    """

    start: int
    text: str
    closed: bool


def top_level_lists(text: str) -> tuple[TopLevelList, ...]:
    """Return the top-level lists of a text, in order.

    In text with unbalanced parentheses or quotes, each line that begins a construct begins a part.
    """
    code = blank(text)
    found = [TopLevelList(start, text[start:end], end is not None) for start, end in top_level(code)]
    if _is_clean(text, code, found):
        return tuple(found)
    return tuple(_cut(text))


def _is_clean(text: str, code: str, found: list[TopLevelList]) -> bool:
    """Return whether all lists are closed and no construct begins inside another."""
    if any(not part.closed for part in found) or code.count("(") != code.count(")"):
        return False
    starts = {part.start for part in found}
    if any(match.start(1) not in starts for match in _BEGIN.finditer(code)):
        return False
    return not any(match["unclosed"] for match in HIDDEN.finditer(text))


def _cut(text: str) -> Iterator[TopLevelList]:
    begins = [match.start(1) for match in _BEGIN.finditer(text)]
    edges = [0, *begins, len(text)]
    for begin, end in pairwise(edges):
        yield from _parts_of(text, begin, end)


def _parts_of(text: str, begin: int, end: int) -> Iterator[TopLevelList]:
    code = blank(text[begin:end])
    for start, stop in top_level(code):
        last = len(code.rstrip()) if stop is None else stop
        yield TopLevelList(begin + start, text[begin + start : begin + last], stop is not None)


def open_lists(part: str) -> list[int]:
    """Return the offsets of the lists that are never closed, outermost first."""
    open_starts: list[int] = []
    for match in PARENTHESIS.finditer(blank(part)):
        if match[0] == "(":
            open_starts.append(match.start())
        elif open_starts:
            open_starts.pop()
    return open_starts
