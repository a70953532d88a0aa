"""Events of navigation graphs, for recordings and for clients that draw maps."""

from __future__ import annotations

from cxbridge.events import EventBus, NavGraphRead
from cxbridge.space.navgraph.graph import NavGraph


def emit_navgraph(bus: EventBus, graph: NavGraph) -> None:
    """Emit :class:`NavGraphRead` with the nodes and edges of a graph, if the event has a listener."""
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
