"""Messages that foreign threads deliver, for the thread that polls."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, Final

MOST_KEPT: Final = 1000
"""Items that are kept of a source without a depth."""


class InboxSource:
    """One of those whom something comes for; made by :meth:`MessageInbox.source`.

    :param depth: the number of messages that are kept: the oldest is dropped; 0: :data:`MOST_KEPT`.
    :param deliver: gets the messages.
    """

    __slots__ = ("deliver", "depth", "is_open", "waiting")

    def __init__(self, deliver: Callable[[Any], None], depth: int) -> None:
        self.deliver, self.depth = deliver, depth or MOST_KEPT
        self.is_open = True
        self.waiting: deque[int] = deque()


class MessageInbox:
    """Keeps messages in the order of their arrival."""

    def __init__(self) -> None:
        self._came = threading.Condition()
        self._items: dict[int, tuple[InboxSource, Any]] = {}
        self._numbers = count()

    def put(self, source: InboxSource, item: Any) -> None:
        """Keep something; in any thread."""
        with self._came:
            if not source.is_open:
                return
            if len(source.waiting) >= source.depth:
                del self._items[source.waiting.popleft()]
            number = next(self._numbers)
            source.waiting.append(number)
            self._items[number] = source, item
            self._came.notify()

    def end(self, source: InboxSource) -> None:
        """Keep no more messages of a source, and forget the kept ones."""
        with self._came:
            source.is_open = False
            while source.waiting:
                del self._items[source.waiting.popleft()]

    def hand_out(self, timeout_s: float) -> bool:
        """Deliver the messages in this thread; wait ``timeout`` for one. Return whether there was one."""
        with self._came:
            if timeout_s > 0:
                self._came.wait_for(lambda: self._items, timeout_s)
            left = len(self._items)
        any_came = left > 0
        while left and (found := self._first()) is not None:
            source, item = found
            source.deliver(item)
            left -= 1
        return any_came

    def _first(self) -> tuple[InboxSource, Any] | None:
        with self._came:
            if not self._items:
                return None
            number = next(iter(self._items))
            source, item = self._items.pop(number)
            source.waiting.popleft()
            return source, item
