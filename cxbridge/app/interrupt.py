"""Ctrl-C while CLIPS runs: no exception can pass through C, so the signal is noted and ends the run.

Python calls a handler between two instructions of the main thread; while that one is in CLIPS, in
``(while TRUE ...)`` say, there are none. So a thread waits for signals, too (the pipe of
:func:`signal.set_wakeup_fd`, which C writes to), and asks CLIPS to stop from there, until it does.
"""

from __future__ import annotations

import os
import select
import signal
import threading
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Callable

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_AGAIN_SECONDS = 0.05
_SIGNALS_TO_DIE = 3
_INTERRUPTED = 130
_END = b"\0"


class Interrupt:
    """Notes SIGINT, SIGTERM and SIGHUP as long as it is entered; signals that are ignored stay so.

    The third signal ends the process on the spot: a C function that does not return cannot be asked.

    Does nothing in other threads than the main one, where Python delivers no signals.

    :param stop: called at a signal, again and again while the run goes on, also from another thread; makes
        whatever runs come to its end soon.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop
        self._before: dict[signal.Signals, object] = {}
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self._pipe = (-1, -1)
        self._wakeup_before = -1
        self.received = False

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note)
            self._pipe = os.pipe()
            os.set_blocking(self._pipe[1], False)
            self._wakeup_before = signal.set_wakeup_fd(self._pipe[1], warn_on_full_buffer=False)
            self._thread = threading.Thread(target=self._wait, name="interrupt", daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]  # what signal() gave it takes
        self._before = {}
        if self._thread is not None:
            signal.set_wakeup_fd(self._wakeup_before)
            self._over.set()
            os.write(self._pipe[1], _END)
            self._thread.join()
            self._thread = None
            for end in self._pipe:
                os.close(end)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.received = True
        self._stop()

    def _wait(self) -> None:
        """Wait for a signal that we note, and ask for the end until it has come."""
        noted = 0
        while not self._over.is_set():
            ready, _, _ = select.select([self._pipe[0]], [], [], _AGAIN_SECONDS if noted else None)
            if ready:
                noted += sum(number in self._before for number in os.read(self._pipe[0], 64))
            if noted >= _SIGNALS_TO_DIE:
                os.write(2, b"cxbridge: the run does not react, it is ended on the spot\n")
                os._exit(_INTERRUPTED)
            if noted:
                self.received = True
                self._stop()

    def check(self) -> None:
        """Raise KeyboardInterrupt when a signal has come."""
        if self.received:
            raise KeyboardInterrupt
