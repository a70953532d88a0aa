"""The thread in which a remote blackboard calls its listeners and observers.

Listeners may take long, and may send requests. In the receiving thread, they would delay the frames, and wait
for replies that the same thread has to receive.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any, Final

Call = tuple[Callable[..., object], tuple[Any, ...], bool]
"""The function, its arguments, and whether it is urgent."""


class Dispatcher:
    """Runs the calls of all threads in one thread, in order.

    :param report: called with the name and error of a failed call.
    """

    def __init__(self, name: str, report: Callable[[str, Exception], None]) -> None:
        self._report: Final = report
        self._queue: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        # a daemon thread, because a listener that hangs must not keep the process alive
        self._thread: Final = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self.thread_id: Final = self._thread.ident
        """The identifier of the thread, as in `threading.get_ident`."""

    def put(self, function: Callable[..., object], *args: Any, is_urgent: bool = False) -> None:
        """Queue a call.

        :param is_urgent: whether a subclass may make the call even while a listener waits for a reply.
        """
        self._queue.put((function, args, is_urgent))

    def is_current_thread(self) -> bool:
        """Return whether the caller runs in the dispatcher's thread."""
        return threading.get_ident() == self.thread_id

    def drain(self, timeout: float) -> bool:
        """Wait until the calls queued so far have been made; return False after the timeout.

        A listener that waits in the dispatcher's thread would block the queue, so there the method returns
        True at once, as it does after the end of the thread.

        :param timeout: the limit in seconds.
        """
        if self.is_current_thread() or not self._thread.is_alive():
            return True
        all_calls_made = threading.Event()
        self.put(all_calls_made.set)
        return all_calls_made.wait(timeout)

    def stop(self, timeout: float | None = None) -> None:
        """End the thread after the queued calls and wait for it, unless called within the thread.

        :param timeout: the limit in seconds; None: no limit.
        """
        self._queue.put(None)
        if not self.is_current_thread():
            self._thread.join(timeout)

    def _run(self) -> None:
        """Make the queued calls until :meth:`stop` queues None."""
        while (call := self._queue.get()) is not None:
            self._call(*call)

    def _call(self, function: Callable[..., object], args: tuple[Any, ...], _is_urgent: bool) -> None:
        try:
            function(*args)
        except Exception as error:  # noqa: BLE001 - a listener's fault must not end the thread of all listeners
            self._report(getattr(function, "__name__", "event"), error)
