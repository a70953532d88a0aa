"""Inbox for messages from foreign threads, delivered in the polling thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, Final

MAX_QUEUED: Final = 1000  # default limit of queued messages of a source


class InboxSource:
    """A source of messages.

    :param deliver: called with each message.
    :param depth: the limit of queued messages, whose oldest is dropped; 0 for :data:`MAX_QUEUED`.
    """

    __slots__ = ("deliver", "depth", "is_open", "queued")

    def __init__(self, deliver: Callable[[Any], None], depth: int) -> None:
        self.deliver, self.depth = deliver, depth or MAX_QUEUED
        self.is_open = True
        self.queued: deque[int] = deque()  # numbers of its messages in the inbox


class MessageInbox:
    """Queues the messages of all sources in the order of arrival."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._messages: dict[int, tuple[InboxSource, Any]] = {}
        self._numbers = count()

    def put(self, source: InboxSource, message: Any) -> None:
        """Queue a message; called from any thread."""
        with self._condition:
            if not source.is_open:
                return
            if len(source.queued) >= source.depth:
                del self._messages[source.queued.popleft()]
            number = next(self._numbers)
            source.queued.append(number)
            self._messages[number] = source, message
            self._condition.notify()

    def end(self, source: InboxSource) -> None:
        """Drop the queued and all further messages of a source."""
        with self._condition:
            source.is_open = False
            while source.queued:
                del self._messages[source.queued.popleft()]

    def deliver(self, timeout_s: float) -> bool:
        """Deliver the queued messages in this thread, or wait for the first; return whether there was one."""
        with self._condition:
            if timeout_s > 0:
                self._condition.wait_for(lambda: self._messages, timeout_s)
            remaining = len(self._messages)
        any_queued = remaining > 0
        # messages that arrive meanwhile belong to the next call; no lock here, since callbacks may put some
        while remaining and (entry := self._pop()) is not None:
            source, message = entry
            source.deliver(message)
            remaining -= 1
        return any_queued

    def _pop(self) -> tuple[InboxSource, Any] | None:
        with self._condition:
            if not self._messages:
                return None  # a callback has ended the last source
            number = next(iter(self._messages))
            source, message = self._messages.pop(number)
            source.queued.popleft()
            return source, message
