"""The navigation graphs that the page draws."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.events import Event, EventBus, NavGraphRead


class NavGraphs:
    """The last event of each graph. Thread-safe."""

    def __init__(self, bus: EventBus) -> None:
        self._bus = bus
        self._graphs: dict[str, NavGraphRead] = {}
        bus.subscribe(self._store_graph, NavGraphRead)

    def _store_graph(self, event: Event) -> None:
        if isinstance(event, NavGraphRead):
            # a new dictionary, because other threads iterate over the previous dictionary
            self._graphs = {**self._graphs, event.graph: event}

    def list_graphs(self) -> Iterable[NavGraphRead]:
        """Return the events in the order of the first reading of each graph."""
        return self._graphs.values()

    def close(self) -> None:
        """Stop listening."""
        self._bus.unsubscribe(self._store_graph)
