"""Orderly shutdown of a process on SIGINT, SIGTERM and SIGHUP.

A handler only records its signal, because exceptions cannot pass through C, and a handler must not take locks
that the interrupted code may hold. A second thread also waits for signals, on the socket of
:func:`signal.set_wakeup_fd` to which C writes. The thread requests the end of the work and soon forces it,
for example by interrupting rules in ``(while TRUE ...)``.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, ClassVar, Final, Self

# Chosen freely: 15 cycles of the main loop.
GRACE_S: Final = 0.5
"""The seconds in which running work may end by itself, e.g. the current cycle of the main loop."""

# Chosen freely.
GOODBYE_S: Final = 2.0
"""The additional seconds for rules of the shutdown."""

_SIGNALS = (
    signal.SIGINT,
    signal.SIGTERM,
    *((signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()),  # Windows lacks it
)
# The type of handlers for :func:`signal.signal`.
_Handler = Callable[[int, FrameType | None], Any] | int | signal.Handlers | None

_REPEAT_S = 0.05  # seconds between calls of ``stop``, then of ``force``
_FATAL_SIGNALS = 3  # signals after which the process ends immediately
_SIGINT_STATUS = 130  # the exit status of shells for SIGINT
_END_BYTE = b"\0"  # wakes the thread without a signal: no signal has the number 0


def _do_nothing() -> None: ...


class Interrupt:
    """Records SIGINT, SIGTERM and SIGHUP while it is entered.

    Enter it before creating resources that need a clean-up, and leave it after the clean-up. A nested
    instance takes over the signals that the outer instance has recorded, and passes its own signals back.
    Ignored signals remain ignored, except SIGINT for a service: shells start background jobs with SIGINT
    ignored, and a service has no terminal whose Ctrl-C is for other programs. The third signal ends the
    process immediately, because a C function that does not return cannot be interrupted. In threads other
    than the main thread, where Python delivers no signals, an instance has no effect.

    :param stop: called repeatedly after a signal in a second thread to request the end.
    :param force: called repeatedly after :data:`GRACE_S` in the second thread to end work that does not end.
    :param is_service: whether the process serves clients until a signal.
    """

    _entered_instances: ClassVar[list[Interrupt]] = []  # from the outermost to the innermost instance

    def __init__(
        self,
        stop: Callable[[], None] = _do_nothing,
        force: Callable[[], None] = _do_nothing,
        *,
        is_service: bool = False,
    ) -> None:
        self._stop, self._force = stop, force
        self._is_service = is_service
        self._replaced_handlers: dict[signal.Signals, _Handler] = {}
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._sockets: tuple[socket.socket, socket.socket] | None = None  # reader and writer
        self._outer_wakeup_fd = -1
        self._force_at_s = 0.0  # by the monotonic clock
        self._handled_numbers = [int(signal_number) for signal_number in _SIGNALS]
        self.is_signalled = False
        """Whether a signal was recorded."""

    def __enter__(self) -> Self:
        if threading.current_thread() is not threading.main_thread():
            return self
        for signal_number in _SIGNALS:
            is_service_interrupt = self._is_service and signal_number == signal.SIGINT
            if is_service_interrupt or signal.getsignal(signal_number) is not signal.SIG_IGN:
                self._replaced_handlers[signal_number] = signal.signal(signal_number, self._record_signal)
        self._handled_numbers = [int(signal_number) for signal_number in self._replaced_handlers]
        # a socket, because Windows cannot wait for a pipe
        self._sockets = reader, writer = socket.socketpair()
        writer.setblocking(False)
        self._outer_wakeup_fd = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(
            target=self._request_end_on_signals, args=(reader,), name="interrupt", daemon=True
        )
        self._thread.start()
        outer = self._entered_instances[-1] if self._entered_instances else None
        self._entered_instances.append(self)
        if outer is not None and outer.is_signalled:
            self._pass_signal_to(self)
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._thread is None or self._sockets is None:
            return
        signal.set_wakeup_fd(self._outer_wakeup_fd)
        for signal_number, handler in self._replaced_handlers.items():
            signal.signal(signal_number, handler)
        self._replaced_handlers = {}
        self._ended.set()
        with contextlib.suppress(BlockingIOError):  # full of signals, so the thread is awake
            self._sockets[1].send(_END_BYTE)
        self._thread.join()
        for sock in self._sockets:
            sock.close()
        self._thread = self._sockets = None
        self._entered_instances.remove(self)
        if self.is_signalled and self._entered_instances:
            self._pass_signal_to(self._entered_instances[-1])

    @staticmethod
    def _pass_signal_to(receiver: Interrupt) -> None:
        """Pass a signal to another instance."""
        receiver.is_signalled = True
        # the number of any handled signal wakes the thread like the signal itself
        if receiver._sockets is not None:
            with contextlib.suppress(BlockingIOError):  # full of signals, so the thread is awake
                receiver._sockets[1].send(bytes(receiver._handled_numbers[:1]))

    def replace_functions(self, stop: Callable[[], None], force: Callable[[], None] = _do_nothing) -> None:
        """Replace the functions ``stop`` and ``force``; they are called soon if a signal was recorded."""
        self._stop, self._force = stop, force

    def give_time(self, grace_s: float = GRACE_S) -> None:
        """Call ``force`` not earlier than in ``grace_s`` seconds, so that running work can end by itself."""
        self._force_at_s = time.monotonic() + grace_s

    def _record_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.is_signalled = True

    def _request_end_on_signals(self, signal_socket: socket.socket) -> None:
        """Wait for a signal, then request the end repeatedly."""
        signal_count = 0
        while not self._ended.is_set():
            signal_socket.settimeout(_REPEAT_S if signal_count else None)
            with contextlib.suppress(TimeoutError):  # the time for the next call of ``stop`` or ``force``
                new_signal_count = sum(
                    signal_number in self._handled_numbers for signal_number in signal_socket.recv(64)
                )  # further bytes wait for the next round
                if new_signal_count and not signal_count:
                    self._force_at_s = max(self._force_at_s, time.monotonic() + GRACE_S)
                signal_count += new_signal_count
            if signal_count >= _FATAL_SIGNALS:
                os.write(2, b"cxbridge: the process does not stop: the third signal ends it at once\n")
                os._exit(_SIGINT_STATUS)
            if signal_count:
                self.is_signalled = True
                self._stop()
                if time.monotonic() >= self._force_at_s:
                    self._force()

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal was recorded."""
        if self.is_signalled:
            raise KeyboardInterrupt
