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


def _nothing() -> None:
    pass


class Dispatcher:
    """Calls what others hand in, one after the other.

    One of what it calls may be to receive, for the link: then the one who hands something in has to wake it.

    :param name: of the thread.
    :param report: called for what fails.
    """

    def __init__(self, name: str, report: Callable[[str, Exception], None]) -> None:
        self._report = report
        self._queue: queue.SimpleQueue[Work | None] = queue.SimpleQueue()
        self._backlog: deque[Work | None] = deque()
        self._ended = False
        self.nothing_waits: Final = self._queue.empty
        """Whether nothing that was handed in is still to be called; when no listener is waiting."""
        self.idle = False
        """Whether it waits for something to do."""
        self.receiving = False
        """Whether it waits for the server, rather than for what is handed in."""
        self.on_idle: Callable[[], None] = _nothing
        """Called when it becomes idle."""
        self.wake: Callable[[], None] = _nothing
        """Ends its waiting for the server."""
        self.stop_receiving: Callable[[], None] = _nothing
        """Lets another thread receive; called when a listener waits for an answer."""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self.ident: Final = self._thread.ident
        """Of the thread, as :func:`threading.get_ident` has it."""

    def put(self, work: Callable[..., None], *args: Any, urgent: bool = False) -> None:
        """Let the thread call ``work``.

        :param urgent: also while a listener waits for an answer of the server.
        """
        self._queue.put((work, args, urgent))
        if self.receiving:
            self.wake()

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
        self.stop_receiving()
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
                self._call(*item)
            else:
                self._backlog.append(item)

    def call_waiting(self) -> None:
        """Call all that waits; in the thread."""
        while not self._ended:
            if self._backlog:
                item = self._backlog.popleft()
            elif self._queue.empty():
                return
            else:
                item = self._queue.get()
            if item is None:
                self._ended = True
                return
            self._call(*item)

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
            self.call_waiting()
            if self._ended:
                return
            self.idle = True
            self.on_idle()
            self._backlog.append(self._queue.get())
            self.idle = False

    def _call(self, work: Callable[..., None], args: tuple[Any, ...], _: bool) -> None:
        try:
            work(*args)
        except Exception as error:  # noqa: BLE001 - the next ones are to be called
            self._report(getattr(work, "__name__", "event"), error)
