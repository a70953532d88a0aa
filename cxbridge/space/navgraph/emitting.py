"""Events of navigation graphs, for recordings and for clients that draw maps."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.events import Event, EventBus, NavGraphRead
from cxbridge.space.navgraph.graph import NavGraph


def emit_navgraph(bus: EventBus, graph: NavGraph) -> None:
    """Emit :class:`NavGraphRead` if it has a listener."""
    if not bus.wants(NavGraphRead):
        return
    nodes = {
        node.name: {
            "x": node.x,
            "y": node.y,
            "unconnected": node.unconnected,
            "properties": dict(node.properties),
        }
        for node in graph.nodes
    }
    edges = {
        f"{edge.start}{'->' if edge.directed else '--'}{edge.end}": {
            "from": edge.start,
            "to": edge.end,
            "directed": edge.directed,
        }
        for edge in graph.edges
    }
    bus.emit(NavGraphRead(bus.clock.now_us(), graph.name, nodes, edges))


class NavGraphs:
    """The last event of each graph. Thread-safe."""

    def __init__(self, bus: EventBus) -> None:
        self._bus = bus
        self._graphs: dict[str, NavGraphRead] = {}
        bus.subscribe(self._store_graph, NavGraphRead)

    def _store_graph(self, event: Event) -> None:
        if isinstance(event, NavGraphRead):
            # replaced, never changed, because other threads iterate over it
            self._graphs = {**self._graphs, event.graph: event}

    def all(self) -> Iterable[NavGraphRead]:
        """Return the events in the order of the first reading of each graph."""
        return self._graphs.values()

    def close(self) -> None:
        """Stop listening."""
        self._bus.unsubscribe(self._store_graph)
