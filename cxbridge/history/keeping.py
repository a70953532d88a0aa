"""Lists with a limit, which count omitted items."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")

LONGEST = 2000
"""How many characters of a text a page keeps."""


class Kept(Generic[Item]):
    """The first and the last items: the middle goes when there are too many.

    :param limit: how many are kept, half of them from the start.
    """

    def __init__(self, limit: int) -> None:
        self.total = 0
        self._head: list[Item] = []
        self._tail: deque[Item] = deque(maxlen=limit - limit // 2)
        self._room = limit // 2

    def add(self, item: Item) -> None:
        """Add an item."""
        self.total += 1
        if len(self._head) < self._room:
            self._head.append(item)
        else:
            self._tail.append(item)

    @property
    def lost(self) -> int:
        """How many were left out."""
        return self.total - len(self._head) - len(self._tail)

    @property
    def gap(self) -> int | None:
        """The place in :meth:`items` before which some were left out, None when all are kept."""
        return len(self._head) if self.lost else None

    def items(self) -> list[Item]:
        """Return the kept items, in order."""
        return [*self._head, *self._tail]


def cut(text: str, longest: int = LONGEST) -> str:
    """Return a text, or its begin and how long it is."""
    return text if len(text) <= longest else f"{text[:longest]} … ({len(text)} characters)"
