"""An inbox for messages that arrive in threads of Zenoh, and are delivered in the polling thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, Final

MAX_QUEUED_MESSAGES: Final = 1000  # default limit of the queued messages of a source


class InboxSource:
    """A source of messages, such as a subscription.

    :param deliver: called with each message.
    :param depth: the limit of queued messages; a further message replaces the oldest. 0 stands for
        :data:`MAX_QUEUED_MESSAGES`.
    :ivar queued_numbers: the numbers of the source's messages in the inbox.
    """

    __slots__ = ("deliver", "depth", "is_open", "queued_numbers")

    def __init__(self, deliver: Callable[[Any], None], depth: int) -> None:
        self.deliver, self.depth = deliver, depth or MAX_QUEUED_MESSAGES
        self.is_open = True
        self.queued_numbers: deque[int] = deque()


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
            if len(source.queued_numbers) >= source.depth:
                del self._messages[source.queued_numbers.popleft()]
            number = next(self._numbers)
            source.queued_numbers.append(number)
            self._messages[number] = source, message
            self._condition.notify()

    def close_source(self, source: InboxSource) -> None:
        """Drop the queued and all further messages of a source."""
        with self._condition:
            source.is_open = False
            while source.queued_numbers:
                del self._messages[source.queued_numbers.popleft()]

    def deliver(self, timeout_s: float) -> bool:
        """Deliver the queued messages in this thread; return whether there were messages.

        :param timeout_s: how long to wait for the first message.
        """
        with self._condition:
            if timeout_s > 0:
                self._condition.wait_for(lambda: self._messages, timeout_s)
            remaining_count = len(self._messages)
        any_queued = remaining_count > 0
        # Messages that arrive during the delivery belong to the next call. The lock is not held during a
        # callback, which may queue messages.
        while remaining_count and (entry := self._pop()) is not None:
            source, message = entry
            source.deliver(message)
            remaining_count -= 1
        return any_queued

    def _pop(self) -> tuple[InboxSource, Any] | None:
        with self._condition:
            if not self._messages:
                return None  # a callback has closed the source of the remaining messages
            number = next(iter(self._messages))
            source, message = self._messages.pop(number)
            source.queued_numbers.popleft()
            return source, message
