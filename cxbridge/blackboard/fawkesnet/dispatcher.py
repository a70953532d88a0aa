"""A thread that calls listeners, one event after the other."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final

Call = Callable[[], None]


class Dispatcher:
    """Runs what it is given in its own thread, in order.

    :param name: of the thread.
    :param report: called for what fails.
    """

    def __init__(self, name: str, report: Callable[[str, Exception], None]) -> None:
        self._report: Final = report
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def is_current(self) -> bool:
        """Whether the caller is run by it."""
        return threading.current_thread() is self._thread

    def put(self, call: Call) -> None:
        """Run ``call`` after all that was put before."""
        self._calls.put(call)

    def drain(self, timeout: float) -> bool:
        """Wait until all that was put before has run; return whether it has.

        At once from within a call: what waits cannot run before that returns.
        """
        if self.is_current:
            return True
        done = threading.Event()
        self._calls.put(done.set)
        return done.wait(timeout)

    def stop(self, timeout: float) -> None:
        """Run what was put before, and end."""
        self._calls.put(None)
        if not self.is_current:
            self._thread.join(timeout)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            try:
                call()
            except Exception as error:  # noqa: BLE001 - must not end the thread
                self._report("an event", error)
