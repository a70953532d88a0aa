"""A navigation graph: nodes with position and properties, edges in one or both directions.

The graph behaves like Fawkes' navgraph (``src/libs/navgraph``): of several nodes at the same distance the
first node is the closest, and the neighbours of a node are sorted by name.
"""

from __future__ import annotations

import heapq
import itertools
import math
import re
from collections.abc import Mapping

from msgspec import Struct, field

from cxbridge.errors import NavGraphError

# Fawkes converts properties with C's atof and atoi, which read the longest number at the start
_FLOAT = re.compile(r"\s*[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?")
_INTEGER = re.compile(r"\s*[+-]?\d+")
_TRUE_TEXTS = frozenset(["true", "yes", "1"])


def property_as_float(text: str) -> float:
    """Return the number at the start of a property's text, or 0."""
    match = _FLOAT.match(text)
    return float(match[0]) if match else 0.0


def property_as_int(text: str) -> int:
    """Return the integer at the start of a property's text, or 0."""
    match = _INTEGER.match(text)
    return int(match[0]) if match else 0


def property_as_bool(text: str) -> bool:
    """Return whether a property's text is true, yes or 1."""
    return text in _TRUE_TEXTS


class NavGraphNode(Struct, frozen=True):
    """A place.

    :param x: the first coordinate in the fixed frame, in metres like ``y``.
    :param properties: the texts of the properties by name; a property without a value is ``true``.
    :param unconnected: whether the node only marks a place and cannot have edges.
    """

    name: str
    x: float
    y: float
    properties: Mapping[str, str] = field(default_factory=dict)
    unconnected: bool = False

    def distance(self, x: float, y: float) -> float:
        """Return the distance to a point in metres."""
        return math.hypot(self.x - x, self.y - y)


class NavGraphEdge(Struct, frozen=True):
    """A connection from one node to another, and back unless the edge is directed."""

    start: str
    end: str
    directed: bool = False
    properties: Mapping[str, str] = field(default_factory=dict)

    def joins(self, start: str, end: str) -> bool:
        """Return whether the edge leads from one node to another."""
        return (self.start, self.end) == (start, end) or (
            not self.directed and (self.end, self.start) == (start, end)
        )


class NavGraphPath(Struct, frozen=True):
    """A path through a graph.

    :param nodes: the nodes of the path, including the first and the last.
    :param cost: the length in metres.
    """

    nodes: tuple[NavGraphNode, ...]
    cost: float


class NavGraph:
    """A mutable navigation graph.

    :param default_properties: the properties that readers give to nodes without these properties; they are
        not in :attr:`NavGraphNode.properties`.
    """

    def __init__(self, name: str, default_properties: Mapping[str, str] | None = None) -> None:
        self.name = name
        self.default_properties = dict(default_properties or {})
        self._nodes: dict[str, NavGraphNode] = {}
        self._edges: list[NavGraphEdge] = []
        self._blocked_directions: set[tuple[str, str]] = set()
        self._neighbours: dict[str, tuple[str, ...]] = {}  # computed on demand, until an edge changes
        self.revision = 0
        """Increases with each change of nodes and edges."""

    @property
    def nodes(self) -> tuple[NavGraphNode, ...]:
        """All nodes in the order of addition."""
        return tuple(self._nodes.values())

    def node(self, name: str) -> NavGraphNode | None:
        """Return a node by name, or None."""
        return self._nodes.get(name)

    def add_node(self, node: NavGraphNode) -> None:
        """Add a node.

        :raises NavGraphError: if the name is in use.
        """
        if node.name in self._nodes:
            raise NavGraphError(f"Node with name {node.name} already exists")
        self.replace_node(node)

    def replace_node(self, node: NavGraphNode) -> None:
        """Add a node; a node with the same name is replaced."""
        self._nodes[node.name] = node
        self.revision += 1

    def search_nodes(self, property_name: str = "") -> list[NavGraphNode]:
        """Return the nodes with a property; with an empty name, all nodes."""
        return [
            node for node in self._nodes.values() if not property_name or property_name in node.properties
        ]

    def closest_node(
        self,
        x: float,
        y: float,
        property_name: str = "",
        *,
        include_unconnected: bool = False,
        other_than: str = "",
    ) -> NavGraphNode | None:
        """Return the closest node to a point; None if no node qualifies.

        :param property_name: the property that the node must have; empty for any node.
        :param include_unconnected: whether the closest node may be unconnected.
        :param other_than: the name of a node to exclude.
        """
        candidates = [
            node
            for node in self.search_nodes(property_name)
            if (include_unconnected or not node.unconnected) and node.name != other_than
        ]
        return min(candidates, key=lambda node: node.distance(x, y), default=None)

    @property
    def edges(self) -> tuple[NavGraphEdge, ...]:
        """All edges in the order of addition."""
        return tuple(self._edges)

    def edge(self, start: str, end: str) -> NavGraphEdge | None:
        """Return the edge from one node to another, or None."""
        return next((edge for edge in self._edges if edge.joins(start, end)), None)

    def add_edge(self, edge: NavGraphEdge) -> None:
        """Add an edge.

        :raises NavGraphError: if a node is unknown or unconnected, or the edge exists.
        """
        for name in (edge.start, edge.end):
            node = self._nodes.get(name)
            if node is None:
                raise NavGraphError(f"Node '{name}' for edge '{edge.start}' -> '{edge.end}' does not exist")
            if node.unconnected:
                raise NavGraphError(
                    f"Node {name} is marked unconnected but is an end of "
                    f"the edge '{edge.start}' -> '{edge.end}'"
                )
        if self.edge(edge.start, edge.end) is not None:
            raise NavGraphError(f"Edge from {edge.start} to {edge.end} already exists")
        self._edges.append(edge)
        self._neighbours.clear()
        self.revision += 1

    def remove_edge(self, edge: NavGraphEdge) -> None:
        """Remove one of :attr:`edges`, and its blocks; any other object is ignored, even an equal edge."""
        self._edges = [remaining for remaining in self._edges if remaining is not edge]
        self._blocked_directions = {ends for ends in self._blocked_directions if self.edge(*ends) is not None}
        self._neighbours.clear()
        self.revision += 1

    def neighbours(self, name: str) -> tuple[str, ...]:
        """Return the sorted names of the nodes to which an edge leads from a node."""
        if name not in self._neighbours:
            ends = {edge.end for edge in self._edges if edge.start == name}
            ends |= {edge.start for edge in self._edges if edge.end == name and not edge.directed}
            self._neighbours[name] = tuple(sorted(ends))
        return self._neighbours[name]

    def unreachable_nodes(self) -> list[str]:
        """Return the sorted names of the nodes to which no path leads from the first node.

        Nodes that are marked as unconnected do not count, and blocks are ignored.
        """
        names = [node.name for node in self._nodes.values() if not node.unconnected]
        reached_names, open_names = set(names[:1]), names[:1]
        while open_names:
            new_names = [name for name in self.neighbours(open_names.pop()) if name not in reached_names]
            reached_names.update(new_names)
            open_names.extend(new_names)
        return sorted(set(names) - reached_names)

    def block(self, start: str, end: str) -> None:
        """Exclude the edge from one node to another, in this direction, from paths.

        :raises NavGraphError: if there is no such edge.
        """
        if self.edge(start, end) is None:
            raise NavGraphError(f"edge {start}--{end} does not exist in the graph")
        self._blocked_directions.add((start, end))

    def unblock(self, start: str, end: str) -> None:
        """Undo :meth:`block`, if necessary."""
        self._blocked_directions.discard((start, end))

    def search_path(self, start: str, goal: str) -> NavGraphPath | None:
        """Return the shortest path, found by A*; None without a path.

        :raises NavGraphError: if a node is unknown.
        """
        for name in (start, goal):
            if name not in self._nodes:
                names = ", ".join(sorted(self._nodes)) or "none"
                raise NavGraphError(f"there is no node '{name}'", hint=f"there are: {names}")
        goal_node = self._nodes[goal]
        order = itertools.count()  # breaks ties of equal costs by the order of discovery
        # estimated cost of the whole path, order of discovery, cost so far, node, previous node
        queue = [(self._nodes[start].distance(goal_node.x, goal_node.y), next(order), 0.0, start, "")]
        came_from: dict[str, str] = {}  # the previous node of each node; empty for the start
        while queue:
            _, _, cost_so_far, name, previous_name = heapq.heappop(queue)
            if name in came_from:
                continue
            came_from[name] = previous_name
            if name == goal:
                return self._make_path(came_from, goal, cost_so_far)
            node = self._nodes[name]
            for next_name in self.neighbours(name):
                if next_name in came_from or (name, next_name) in self._blocked_directions:
                    continue
                next_node = self._nodes[next_name]
                next_cost = cost_so_far + node.distance(next_node.x, next_node.y)
                # no path is shorter than the straight line, so the first path to the goal is the shortest
                estimate = next_cost + next_node.distance(goal_node.x, goal_node.y)
                heapq.heappush(queue, (estimate, next(order), next_cost, next_name, name))
        return None

    def _make_path(self, came_from: Mapping[str, str], goal: str, cost: float) -> NavGraphPath:
        names = [goal]
        while previous_name := came_from[names[-1]]:
            names.append(previous_name)
        return NavGraphPath(tuple(self._nodes[name] for name in reversed(names)), cost)
