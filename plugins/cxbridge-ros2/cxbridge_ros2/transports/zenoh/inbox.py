"""Inbox for messages from foreign threads, delivered in the polling thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, Final

MOST_KEPT: Final = 1000  # default limit of queued messages of a source


class InboxSource:
    """A source of messages; made by :meth:`MessageInbox.source`.

    :param depth: the limit of queued messages, whose oldest is dropped; 0 for :data:`MOST_KEPT`.
    :param deliver: called with each message.
    """

    __slots__ = ("deliver", "depth", "is_open", "waiting")

    def __init__(self, deliver: Callable[[Any], None], depth: int) -> None:
        self.deliver, self.depth = deliver, depth or MOST_KEPT
        self.is_open = True
        self.waiting: deque[int] = deque()


class MessageInbox:
    """Queues messages in the order of arrival."""

    def __init__(self) -> None:
        self._came = threading.Condition()
        self._items: dict[int, tuple[InboxSource, Any]] = {}
        self._numbers = count()

    def put(self, source: InboxSource, item: Any) -> None:
        """Queue a message; called from any thread."""
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
        """Drop the queued and all further messages of a source."""
        with self._came:
            source.is_open = False
            while source.waiting:
                del self._items[source.waiting.popleft()]

    def hand_out(self, timeout_s: float) -> bool:
        """Deliver the queued messages in this thread, or wait for the first; return whether there was one."""
        with self._came:
            if timeout_s > 0:
                self._came.wait_for(lambda: self._items, timeout_s)
            remaining = len(self._items)
        any_came = remaining > 0
        while remaining and (found := self._first()) is not None:
            source, item = found
            source.deliver(item)
            remaining -= 1
        return any_came

    def _first(self) -> tuple[InboxSource, Any] | None:
        with self._came:
            if not self._items:
                return None
            number = next(iter(self._items))
            source, item = self._items.pop(number)
            source.waiting.popleft()
            return source, item
