"""The interfaces at the server that a watching client knows."""

from __future__ import annotations

from typing import Any

from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.blackboard.listeners import ObserverTable
from cxbridge.blackboard.zmq.wire.dataframes import ZmqFrame


class ExistenceWatch:
    """Notifies observers of new and destroyed interfaces; used by the receiving thread."""

    def __init__(self, observers: ObserverTable, dispatcher: Dispatcher) -> None:
        self._observers = observers
        self._dispatcher = dispatcher
        self._known: set[tuple[str, str]] = set()
        self.on = False
        """Whether the server reports new and destroyed interfaces."""

    def began(self, frame: ZmqFrame) -> None:
        """Compare the interfaces in the reply to Watch with the known ones."""
        there = {(info.type, info.id): None for info in frame.body.interfaces}
        if self.on:
            for key in self._known - there.keys():
                self._dispatcher.put(self._observers.destroyed, *key)
            for key in there:
                if key not in self._known:
                    self._dispatcher.put(self._observers.created, *key)
        self._known = set(there)
        self.on = True

    def existence(self, body: Any) -> None:
        """Handle an Existence event."""
        key = (body.type, body.id)
        if body.created and key not in self._known:
            self._known.add(key)
            self._dispatcher.put(self._observers.created, *key)
        elif not body.created and key in self._known:
            self._known.discard(key)
            self._dispatcher.put(self._observers.destroyed, *key)
