"""A graph of named places and the ways between them."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field

from cxbridge.errors import SkillError


@dataclass(frozen=True, slots=True)
class Node:
    """A place.

    :param x: metres.
    :param y: metres.
    :param orientation: how to stand there, radians; None: as one arrives.
    """

    name: str
    x: float
    y: float
    orientation: float | None = None

    def distance(self, other: Node) -> float:
        """Return how far another node is, metres."""
        return math.hypot(other.x - self.x, other.y - self.y)


@dataclass(frozen=True, slots=True)
class NavGraph:
    """Places and the ways between them.

    :param nodes: by name; one at least.
    :param neighbours: which nodes can be reached from a node directly; nothing at all: each from each.
    """

    nodes: dict[str, Node]
    neighbours: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def node(self, name: str) -> Node:
        """Return a node.

        :raises SkillError: when there is none of that name.
        """
        node = self.nodes.get(name)
        if node is None:
            raise SkillError(f"there is no place '{name}'", hint=f"there are: {', '.join(self.nodes)}")
        return node

    def path(self, begin: str, end: str) -> list[Node]:
        """Return the nodes of the shortest way, without the first one.

        :raises SkillError: when there is no way, or no such node.
        """
        first, last = self.node(begin), self.node(end)
        if not self.neighbours or first is last:
            return [last]
        # ties are broken by the order of the nodes, so that runs repeat
        order = {name: number for number, name in enumerate(self.nodes)}
        heap = [(0.0, order[begin], begin, "")]
        came_from: dict[str, str] = {}
        while heap:
            length, _, name, previous = heapq.heappop(heap)
            if name in came_from:
                continue
            came_from[name] = previous
            if name == end:
                return self._way(came_from, begin, end)
            for other in self.neighbours.get(name, ()):
                if other not in came_from:
                    far = length + self.nodes[name].distance(self.nodes[other])
                    heapq.heappush(heap, (far, order[other], other, name))
        raise SkillError(f"there is no way from {begin} to {end}")

    def _way(self, came_from: dict[str, str], begin: str, end: str) -> list[Node]:
        way = [end]
        while came_from[way[-1]] != begin:
            way.append(came_from[way[-1]])
        return [self.nodes[name] for name in reversed(way)]
