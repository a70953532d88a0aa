"""The thread in which a remote blackboard calls its listeners and observers, one event after the other."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any, Final

Work = tuple[Callable[..., object], tuple[Any, ...], bool]
"""What to call, with what, and whether it is urgent."""


class Dispatcher:
    """Runs calls of any thread, in order, in one thread.

    :param name: of the thread.
    :param report: called for what fails.
    """

    def __init__(self, name: str, report: Callable[[str, Exception], None]) -> None:
        self._report: Final = report
        self._queue: queue.SimpleQueue[Work | None] = queue.SimpleQueue()
        self._thread: Final = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self.ident: Final = self._thread.ident
        """Of the thread, as :func:`threading.get_ident` has it."""

    def put(self, work: Callable[..., object], *args: Any, urgent: bool = False) -> None:
        """Call ``work`` after all that was put before.

        :param urgent: also while a listener waits for an answer, where a transport lets it wait here.
        """
        self._queue.put((work, args, urgent))

    def inside(self) -> bool:
        """Return whether the caller is in the thread."""
        return threading.get_ident() == self.ident

    def drain(self, timeout: float) -> bool:
        """Return when all that was put before was called; False when it takes too long.

        At once within the thread: what waits cannot be called before the caller returns.
        """
        if self.inside() or not self._thread.is_alive():
            return True
        passed = threading.Event()
        self.put(passed.set)
        return passed.wait(timeout)

    def stop(self, timeout: float | None = None) -> None:
        """End the thread after the calls in the queue; wait for that, unless in the thread.

        :param timeout: seconds; None: as long as it takes.
        """
        self._queue.put(None)
        if not self.inside():
            self._thread.join(timeout)

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            self._call(*item)

    def _call(self, work: Callable[..., object], args: tuple[Any, ...], _: bool) -> None:
        try:
            work(*args)
        except Exception as error:  # noqa: BLE001 - the next ones are to be called
            self._report(getattr(work, "__name__", "event"), error)
