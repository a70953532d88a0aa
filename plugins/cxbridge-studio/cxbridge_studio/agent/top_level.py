"""Splits CLIPS text into top-level lists, so that a construct with an error affects no other construct."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, PARENTHESIS, blank, top_level_lists

# The beginning of a construct at the start of a line. The beginning also ends an unclosed construct, because
# CLIPS has no nested constructs.
_CONSTRUCT_BEGINNING: Final = re.compile(
    r"^[ \t]*(\((?:def(?:rule|template|facts|function|global|generic|method|class|module|instances|"
    r"message-handler))(?=[\s(]))",
    re.MULTILINE,
)


class TopLevelList(Struct, frozen=True):
    """A top-level list of a text.

    :param start: the offset of the list's first character.
    :param text: the source text of the list; an unclosed list ends before the next construct.
    :param is_closed: whether the list is closed.
    """

    start: int
    text: str
    is_closed: bool


def split_top_level_lists(text: str) -> tuple[TopLevelList, ...]:
    """Return the top-level lists of a text, in order.

    In a text that is not balanced (see :func:`is_balanced`), each beginning of a construct at the start of a
    line begins a list.
    """
    if not is_balanced(text):
        return tuple(_split_at_constructs(text))
    return tuple(
        TopLevelList(start, text[start:end], is_closed=True) for start, end in top_level_lists(blank(text))
    )


def is_balanced(text: str) -> bool:
    """Return whether a text closes its lists and strings, without a surplus ``)`` or a nested construct."""
    code = blank(text)
    ends_by_start = dict(top_level_lists(code))
    return (
        None not in ends_by_start.values()
        and code.count("(") == code.count(")")
        and all(match.start(1) in ends_by_start for match in _CONSTRUCT_BEGINNING.finditer(code))
        and not any(match["unclosed"] for match in HIDDEN.finditer(text))
    )


def _split_at_constructs(text: str) -> Iterator[TopLevelList]:
    """Yield the top-level lists of each part of a text. Each beginning of a construct begins a new part."""
    beginnings = [match.start(1) for match in _CONSTRUCT_BEGINNING.finditer(text)]
    for part_start, part_end in pairwise([0, *beginnings, len(text)]):
        # Each part is blanked separately, so that an unclosed string does not hide the next construct.
        part = text[part_start:part_end]
        code = blank(part)
        for start, end in top_level_lists(code):
            # An unclosed list has no end: it extends to the last character that is not blank.
            list_text = part[start : len(code.rstrip()) if end is None else end]
            yield TopLevelList(part_start + start, list_text, is_closed=end is not None)


def find_open_lists(text: str) -> list[int]:
    """Return the offsets of the lists that are never closed, outermost first."""
    open_starts: list[int] = []
    for match in PARENTHESIS.finditer(blank(text)):
        if match[0] == "(":
            open_starts.append(match.start())
        elif open_starts:
            open_starts.pop()
    return open_starts
