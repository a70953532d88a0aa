"""The base class of blackboards in other processes: connection callbacks and shutdown."""

from __future__ import annotations

import threading
from abc import abstractmethod
from collections.abc import Callable

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.errors import BlackBoardGoneError
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.clock import Clock
from cxbridge.events import EventBus


class RemoteBlackBoard(BlackBoard):
    """A blackboard in another process, over a connection that is restored after a loss.

    The dispatcher's thread calls listeners and observers, soon after the event.
    """

    _dispatcher: Dispatcher  # set by the subclass

    def __init__(self, registry: Registry, clock: Clock, bus: EventBus | None) -> None:
        super().__init__(registry, clock, bus)
        self._complaints = Complaints(self.warn)
        self._is_shut_down = False
        self._shutdown_lock = threading.Lock()  # two threads may shut down at once
        self._connection_callbacks: list[Callable[[bool], None]] = []

    def add_connection_callback(self, callback: Callable[[bool], None]) -> None:
        self._connection_callbacks.append(callback)

    def report_connection(self, connected: bool, text: str) -> None:
        """Log the loss or return of the connection and queue the callbacks."""
        self.warn(text)
        for callback in tuple(self._connection_callbacks):
            self._dispatcher.put(callback, connected)

    def shutdown(self) -> None:
        """Invalidate all instances, end the connection and stop the threads."""
        with self._shutdown_lock:
            if self._is_shut_down:
                return
            self._is_shut_down = True
        self._shut_down()

    @abstractmethod
    def _shut_down(self) -> None:
        """End the connection; called once, in the thread that shuts down."""

    def _check_open(self) -> None:
        """Raise `BlackBoardGoneError` after the shutdown."""
        if self._is_shut_down:
            raise BlackBoardGoneError
