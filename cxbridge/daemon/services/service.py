"""The common parts of all services: clock, log, blackboards, signals and notifications of systemd.

A service is a long-lived process without an agent: record, replay, gateway or executor.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.daemon.systemd import SystemdNotifier
from cxbridge.events import EventBus, LogLine, Sink
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interrupt import Interrupt
from cxbridge.printing import format_count

ReadyCallback = Callable[[Callable[[], None]], None]
"""A function that is called when the service is ready, with a function that stops the service."""


def do_nothing(_value: object) -> None:
    """Do nothing; the default callback of a service."""


def format_write_counts(counts_by_uid: Mapping[str, int]) -> str:
    """Return the numbers of writes and interfaces, with nouns.

    :param counts_by_uid: the number of writes by ``Type::id``.
    """
    write_count = sum(counts_by_uid.values())
    return f"{format_count(write_count, 'write')} of {format_count(len(counts_by_uid), 'interface')}"


class Service(ExitStack):
    """The common parts of a service; a context manager that closes the entered contexts in reverse order.

    SIGINT, SIGTERM and SIGHUP set ``stopped``, even before the first blackboard is opened.

    :param console: gets the log lines.
    :param on_ready: called by :meth:`report_ready`.
    """

    def __init__(self, console: Sink | None = None, on_ready: ReadyCallback = do_nothing) -> None:
        super().__init__()
        self.clock = RealClock()
        self.stopped = threading.Event()
        self._console, self._on_ready = console, on_ready
        self._wake: Callable[[], None] = lambda: None
        self._notifier = SystemdNotifier()
        self._is_ready = False
        self.bus = self.make_bus()

    def make_bus(self) -> EventBus:
        """Return a new bus whose log lines go to the console, if the service has one."""
        bus = EventBus(self.clock)
        if self._console is not None:
            bus.subscribe(self._console, LogLine)
        return bus

    def __enter__(self) -> Self:
        super().__enter__()
        self.enter_context(Interrupt(self.stop, is_service=True))
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool | None:
        if self._is_ready:  # for systemd a failed start must not look like a requested stop
            self._notifier.report_stopping()
        return super().__exit__(error_type, error, traceback)

    def open_blackboard(self, url: str, registry: InterfaceRegistry) -> BlackBoard:
        """Open the blackboard at a URL; the service closes the blackboard on exit.

        :raises CxbridgeError: if no server answers, or the URL is invalid.
        """
        return self.enter_context(open_blackboard(url, registry, self.clock, self.bus))

    def report_ready(self, status: str) -> None:
        """Report readiness, with a status text, to systemd and the callback."""
        self._is_ready = True
        self._notifier.report_ready(status)
        self._on_ready(self.stop)

    def set_wake_function(self, wake: Callable[[], None]) -> None:
        """Set a function that ends a wait when the service is to stop."""
        self._wake = wake
        if self.stopped.is_set():  # a signal has arrived before this call
            wake()

    def stop(self) -> None:
        """Make the service stop soon; callable from any thread."""
        self.stopped.set()
        self._wake()
