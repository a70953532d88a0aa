"""Sends messages to executors; in threads where an executor elsewhere might keep the sender waiting."""

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
"""The number of slow executors after which the remaining ones have to wait."""

Failed = Callable[[str, "Message", BlackBoardError], None]
"""Takes the id of an executor, a message that did not reach it, and why. Called in any thread."""


class MessageDelivery:
    """Sends messages, to each executor in order.

    :param failed: called for undelivered messages.
    """

    def __init__(self, failed: Failed) -> None:
        self._failed = failed
        self._lock = threading.Lock()
        self._waiting: dict[str, deque[tuple[Interface, Message]]] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._closed = False

    def send(self, to: Interface, message: Message) -> bool:
        """Send now; return whether the message was delivered: a failure was reported."""
        try:
            to.msgq_enqueue(message)
        except BlackBoardError as error:
            self._failed(to.id, message, error)
            return False
        return True

    def post(self, to: Interface, message: Message) -> None:
        """Send soon, after the earlier messages to the same executor.

        :param to: an instance that no other code uses.
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
        """Send everything that waits for one executor."""
        while True:
            with self._lock:
                queue = self._waiting[executor]
                if not queue:
                    del self._waiting[executor]
                    return
                to, message = queue.popleft()
            if not self.send(to, message) and self._closed:
                queue.clear()  # no thread waits for this executor again and again

    def close(self) -> None:
        """Send what waits, and no more after that."""
        with self._lock:
            self._closed = True
            pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=True)
