"""Addition of edges that may cross other edges: the crossing is refused, or it becomes a node."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from operator import itemgetter
from typing import Final

from cxbridge.errors import NavGraphError
from cxbridge.space.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode

# a tenth of a millimetre: computed intersections differ by rounding, nodes of a map by centimetres
SAME_PLACE_M: Final = 1e-4
"""The distance in metres below which two points are equal."""

Point = tuple[float, float]


def find_intersection(
    graph: NavGraph, edge: NavGraphEdge, start: NavGraphNode, end: NavGraphNode
) -> Point | None:
    """Return the intersection of an edge and the line between two nodes, ends included, or None."""
    edge_start, edge_end = graph.node(edge.start), graph.node(edge.end)
    # add_edge accepts no edge without its nodes
    assert edge_start is not None
    assert edge_end is not None
    # u leads along the edge, v along the line, w from the start of the edge to the start of the line
    ux, uy, vx, vy = edge_end.x - edge_start.x, edge_end.y - edge_start.y, end.x - start.x, end.y - start.y
    product = ux * vy - uy * vx
    # relative to the lengths, because rounding leaves a small product of parallel lines
    if abs(product) < 1e-12 * max(1.0, math.hypot(ux, uy) * math.hypot(vx, vy)):
        return None  # parallel lines do not cross, although they may overlap
    wx, wy = start.x - edge_start.x, start.y - edge_start.y
    along_edge, along_line = (wx * vy - wy * vx) / product, (wx * uy - wy * ux) / product
    tolerance = 1e-9  # rounding must not separate lines that meet at an end
    if not (-tolerance <= along_edge <= 1 + tolerance and -tolerance <= along_line <= 1 + tolerance):
        return None
    return (start.x + along_line * vx, start.y + along_line * vy)


def add_without_crossing(graph: NavGraph, edge: NavGraphEdge) -> None:
    """Add an edge that must not intersect edges without a common node.

    :raises NavGraphError: if the edge intersects another edge, or cannot be added.
    """
    start, end = graph.node(edge.start), graph.node(edge.end)
    if start and end:
        for other_edge in graph.edges:
            if {edge.start, edge.end} & {other_edge.start, other_edge.end}:
                continue
            if find_intersection(graph, other_edge, start, end):
                raise NavGraphError(
                    f"Failed to add edge {_edge_name(edge)}: it intersects with {_edge_name(other_edge)}",
                    hint="tag the edge !allow-intersection or !split-intersection",
                )
    graph.add_edge(edge)


def add_and_split(graph: NavGraph, edge: NavGraphEdge) -> None:
    """Add an edge, with a node at each intersection, which is new unless there is a node already.

    :raises NavGraphError: if the edge cannot be added.
    """
    start, end = graph.node(edge.start), graph.node(edge.end)
    if start is None or end is None:
        graph.add_edge(edge)  # raises the error
        return
    intersections = []  # distance from the start, point and crossed edge
    for crossed_edge in graph.edges:
        point = find_intersection(graph, crossed_edge, start, end)
        if point:
            intersections.append((start.distance(*point), point, crossed_edge))
    previous_name = edge.start
    for _, point, crossed_edge in sorted(intersections, key=itemgetter(0)):
        middle_name = _find_or_add_node(graph, point)
        if middle_name not in (crossed_edge.start, crossed_edge.end):
            _split_edge(graph, crossed_edge, middle_name)
        if middle_name not in (previous_name, edge.end):
            _add_if_new(
                graph,
                _generate_edge(previous_name, middle_name, edge.properties, directed=edge.directed),
            )
            previous_name = middle_name
    _add_if_new(graph, _generate_edge(previous_name, edge.end, edge.properties, directed=edge.directed))


def _find_or_add_node(graph: NavGraph, point: Point) -> str:
    """Return the name of the node at a point, which is added if necessary."""
    closest = graph.closest_node(*point)
    if closest is not None and closest.distance(*point) < SAME_PLACE_M:
        return closest.name
    # as in Fawkes, whose generated nodes are named U-0, U-1 and so on, too
    name = next(name for number in itertools.count() if graph.node(name := f"U-{number}") is None)
    graph.add_node(NavGraphNode(name, *point))
    return name


def _split_edge(graph: NavGraph, edge: NavGraphEdge, middle_name: str) -> None:
    """Replace an edge by two edges that meet at a node."""
    graph.remove_edge(edge)
    for start, end in ((edge.start, middle_name), (middle_name, edge.end)):
        _add_if_new(graph, NavGraphEdge(start, end, edge.directed, edge.properties))


def _add_if_new(graph: NavGraph, edge: NavGraphEdge) -> None:
    """Add an edge unless it would be a loop or exists."""
    if edge.start != edge.end and graph.edge(edge.start, edge.end) is None:
        graph.add_edge(edge)


def _generate_edge(
    start: str, end: str, properties: Mapping[str, str] | None = None, *, directed: bool = False
) -> NavGraphEdge:
    """Return an edge with the property ``created-for``, by which Fawkes marks generated edges."""
    return NavGraphEdge(start, end, directed, {**(properties or {}), "created-for": f"{start}--{end}"})


def _edge_name(edge: NavGraphEdge) -> str:
    return f"{edge.start}{'>' if edge.directed else '-'}{edge.end}"
