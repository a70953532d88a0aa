"""Delivery of messages to executors. Threads deliver to remote executors, which may block the sender."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Final

from cxbridge.blackboard.errors import BlackBoardError

if TYPE_CHECKING:
    from cxbridge.interfaces.instance import Interface, Message

THREADS: Final = 8
"""The number of blocking executors above which further executors wait."""

Failed = Callable[[str, "Message", BlackBoardError], None]
"""Gets the executor, the undelivered message and the reason. Called in any thread."""


class MessageDelivery:
    """Delivers messages in order per executor.

    :param failed: called for undelivered messages.
    """

    def __init__(self, failed: Failed) -> None:
        self._failed = failed
        self._lock = threading.Lock()
        self._waiting: dict[str, deque[tuple[Interface, Message]]] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._closed = False

    def send(self, to: Interface, message: Message) -> bool:
        """Send synchronously; return whether the message was delivered."""
        try:
            to.msgq_enqueue(message)
        except BlackBoardError as error:
            self._failed(to.id, message, error)
            return False
        return True

    def post(self, to: Interface, message: Message) -> None:
        """Send asynchronously, after earlier messages to the same executor.

        :param to: an instance for exclusive use.
        """
        with self._lock:
            if self._closed:
                return
            queue = self._waiting.get(to.id)
            if queue is not None:
                queue.append((to, message))
                return
            self._waiting[to.id] = deque([(to, message)])
            if self._pool is None:
                self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="skill-board")
            self._pool.submit(self._work, to.id)

    def _work(self, executor: str) -> None:
        while True:
            with self._lock:
                queue = self._waiting[executor]
                if not queue:
                    del self._waiting[executor]
                    return
                to, message = queue.popleft()
            if not self.send(to, message) and self._closed:
                queue.clear()  # after closing, no thread retries for this executor

    def close(self) -> None:
        """Send the pending messages and refuse further ones."""
        with self._lock:
            self._closed = True
            pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=True)
