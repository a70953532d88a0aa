"""Keeps the navigation graphs of a process in their last state, for clients that come later."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.events import Event, EventBus, NavGraphRead


class NavGraphs:
    """Keeps the last event of each graph. The bus may call it in any thread.

    :param bus: reports the graphs.
    """

    def __init__(self, bus: EventBus) -> None:
        self._bus = bus
        self._graphs: dict[str, NavGraphRead] = {}
        bus.subscribe(self._take, NavGraphRead)

    def _take(self, event: Event) -> None:
        if isinstance(event, NavGraphRead):
            self._graphs = {**self._graphs, event.graph: event}

    def all(self) -> Iterable[NavGraphRead]:
        """Return the graphs."""
        return self._graphs.values()

    def close(self) -> None:
        """Listen no more."""
        self._bus.unsubscribe(self._take)
