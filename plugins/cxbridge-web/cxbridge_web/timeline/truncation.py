"""Long sequences of which a page shows the start and the end, with the number of the lost items."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class TruncatedList(Generic[Item]):
    """The first and last items of a sequence, without its middle.

    :param limit: the maximum number of items.
    """

    def __init__(self, limit: int) -> None:
        self.total = 0
        self._head: list[Item] = []
        # with an odd limit, one more of the last items is kept: they show the end of a run
        self._tail: deque[Item] = deque(maxlen=limit - limit // 2)
        self._head_limit = limit // 2

    def add(self, item: Item) -> None:
        self.total += 1
        if len(self._head) < self._head_limit:
            self._head.append(item)
        else:
            self._tail.append(item)

    @property
    def lost(self) -> int:
        """The number of lost items, all from the middle."""
        return self.total - len(self._head) - len(self._tail)

    @property
    def gap(self) -> int | None:
        """The index in `items` of the first item after the lost items; None if no items were lost."""
        return len(self._head) if self.lost else None

    def items(self) -> list[Item]:
        """Return the kept items in order."""
        return [*self._head, *self._tail]
