"""The base of blackboards whose interfaces live in another process."""

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
    """A blackboard behind a connection that can be lost and comes back.

    What differs from a local one: listeners and observers are called in the dispatcher's thread, soon after
    the event; :meth:`flush` waits for that.
    """

    _dispatcher: Dispatcher

    def __init__(self, registry: Registry, clock: Clock, bus: EventBus | None) -> None:
        super().__init__(registry, clock, bus)
        self._complaints = Complaints(self.warn)
        self._gone = False
        self._ending = threading.Lock()
        self._on_connection: list[Callable[[bool], None]] = []

    def on_connection(self, callback: Callable[[bool], None]) -> None:
        """Call ``callback`` when the connection is lost or back; see the base class."""
        self._on_connection.append(callback)

    def announce(self, connected: bool, text: str) -> None:
        """Notify people and programs that the connection is lost or back."""
        self.warn(text)
        for callback in tuple(self._on_connection):
            self._dispatcher.put(callback, connected)

    def shutdown(self) -> None:
        """Make all instances invalid, end the connection and the threads."""
        with self._ending:
            if self._gone:
                return
            self._gone = True
        self._end()

    @abstractmethod
    def _end(self) -> None:
        """Carry out the steps of a shutdown, once."""

    def _check_here(self) -> None:
        """Refuse what cannot be done after the shutdown.

        :raises BlackBoardGoneError: after the shutdown.
        """
        if self._gone:
            raise BlackBoardGoneError
