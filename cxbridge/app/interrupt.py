"""Ctrl-C while CLIPS runs: no exception can pass through C, so the signal is noted and ends the run.

Python calls a handler between two instructions of the main thread; while that one is in CLIPS, in
``(while TRUE ...)`` say, there are none. So a thread waits for signals, too (the socket of
:func:`signal.set_wakeup_fd`, which C writes to), and asks CLIPS to stop from there, until it does.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Callable

_SIGNALS = (
    signal.SIGINT,
    signal.SIGTERM,
    *((signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()),  # Windows lacks it
)
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
        self._pair: tuple[socket.socket, socket.socket] | None = None
        self._wakeup_before = -1
        self.received = False

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note)
            self._pair = reading, writing = socket.socketpair()  # Windows cannot wait for a pipe
            writing.setblocking(False)
            self._wakeup_before = signal.set_wakeup_fd(writing.fileno(), warn_on_full_buffer=False)
            self._thread = threading.Thread(target=self._wait, args=(reading,), name="interrupt", daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]  # what signal() gave it takes
        self._before = {}
        if self._thread is not None and self._pair is not None:
            signal.set_wakeup_fd(self._wakeup_before)
            self._over.set()
            with contextlib.suppress(BlockingIOError):  # full of signals: the thread is awake
                self._pair[1].send(_END)
            self._thread.join()
            for end in self._pair:
                end.close()
            self._thread = self._pair = None

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.received = True
        self._stop()

    def _wait(self, signals: socket.socket) -> None:
        """Wait for a signal that we note, and ask for the end until it has come."""
        noted = 0
        while not self._over.is_set():
            signals.settimeout(_AGAIN_SECONDS if noted else None)
            with contextlib.suppress(TimeoutError):
                noted += sum(number in self._before for number in signals.recv(64))
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
