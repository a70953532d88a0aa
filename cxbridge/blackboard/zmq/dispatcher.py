"""The thread in which a client's listeners and observers are called, in the order of the stream."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final

Work = tuple[Callable[..., None], tuple[Any, ...], bool]
"""What to call, with what, and whether it may be called while a listener waits for an answer."""

FULL: Final = 1024
"""Events that wait; beyond, updates of one interface are conflated."""


class Dispatcher:
    """Calls what others hand in, one after the other.

    :param name: of the thread.
    :param report: told of what fails.
    """

    def __init__(self, name: str, report: Callable[[str, Exception], None]) -> None:
        self._report = report
        self._queue: queue.SimpleQueue[Work | None] = queue.SimpleQueue()
        self._backlog: deque[Work] = deque()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self.ident: Final = self._thread.ident
        """Of the thread, as :func:`threading.get_ident` has it."""

    def put(self, work: Callable[..., None], *args: Any, urgent: bool = False) -> None:
        """Let the thread call ``work``.

        :param urgent: also while a listener waits for an answer of the server.
        """
        self._queue.put((work, args, urgent))

    @property
    def full(self) -> bool:
        """Whether so much waits that it is time to conflate."""
        return self._queue.qsize() >= FULL

    def inside(self) -> bool:
        """Return whether the caller is in the thread."""
        return threading.get_ident() == self.ident

    def wait(self, done: Callable[[], bool], deadline: float) -> None:
        """Do what is urgent until ``done``; for listeners that wait for an answer.

        Whoever makes it done puts something into the queue afterwards.
        """
        while not done():
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return
            try:
                item = self._queue.get(timeout=remaining)
            except queue.Empty:
                return
            if item is None:
                self._queue.put(None)
                return
            if item[2]:
                self._call(item)
            else:
                self._backlog.append(item)

    def drain(self, timeout: float) -> bool:
        """Return when all that was handed in before was called; False when it takes too long."""
        if self.inside() or not self._thread.is_alive():
            return True
        passed = threading.Event()
        self.put(passed.set)
        return passed.wait(timeout)

    def stop(self) -> None:
        """End the thread after what it is just doing; what waits is dropped."""
        self._queue.put(None)
        if not self.inside():
            self._thread.join()

    def _run(self) -> None:
        while True:
            item = self._backlog.popleft() if self._backlog else self._queue.get()
            if item is None:
                return
            self._call(item)

    def _call(self, item: Work) -> None:
        work, args, _ = item
        try:
            work(*args)
        except Exception as error:  # noqa: BLE001 - the next ones are to be called
            self._report(getattr(work, "__name__", "event"), error)
