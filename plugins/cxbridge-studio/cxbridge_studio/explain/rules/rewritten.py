"""Restores the source form of rules that the host rewrites when it loads them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Final

from cxbridge.clipstext.syntax import read
from cxbridge.executive.host.source import DUPLICATE_FUNCTION, MODIFY_FUNCTION

# Source names by the functions that replace them.
_WRITTEN: Final = {MODIFY_FUNCTION: "modify", DUPLICATE_FUNCTION: "duplicate"}

_VALUES: Final = "create$"


def as_written(texts: Mapping[str, str]) -> dict[str, str]:
    """Return rules in their source form, except for blanks and comments.

    :param texts: defrules by name, as the environment prints them.
    """
    return {name: _restored(text) for name, text in texts.items()}


def _restored(text: str) -> str:
    """Return a rule with ``(modify F (slot V...))`` for ``(cx-modify F slot (create$ V...))``."""
    if not any(function in text for function in _WRITTEN):
        return text
    edits: list[tuple[int, int, str]] = []
    for top in read(text):
        for node in top.walk():
            if node.items and node.head in _WRITTEN:
                edits.append((node.items[0].start, node.items[0].end, _WRITTEN[node.head]))
                edits += [
                    (slot.start, value.items[0].end, f"({slot.text}")
                    for slot, value in pairwise(node.items[2:])
                    if slot.items is None and value.head == _VALUES and value.items
                ]
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text
