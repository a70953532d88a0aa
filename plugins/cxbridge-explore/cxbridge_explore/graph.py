"""The explored graph: the states with a choice, and where each option leads.

A node is a choice point in a state; an edge is an option taken at a node. A leaf is the end of a run. A run
that is played is on exactly one open edge, so that the open edges are the remaining work even if processes
die. The counts in a result depend only on the graph, not on the order of the exploration.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from typing import Final

from msgspec import Struct, field

from cxbridge.printing import format_count
from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.used_parts import UsedPart
from cxbridge_explore.worlds.points import USUAL, Choice, ChoicePath, ChoicePoint, make_path

ROOT_EDGE: Final = (-1, USUAL)  # the edge on which each run starts

# The outcome of a run with an invalid scenario; such a run ends the exploration.
BAD_INPUT: Final = "bad input"

# The outcome of a run whose choice points differ from those of an earlier run on the same path.
DIVERGED: Final = "diverged"

# The number of a node, or -1 before the first node, and the index of the option that is taken at the node.
Edge = tuple[int, int]


class Leaf(Struct, frozen=True):
    """The end of a run.

    :param outcome: completed, unsuccessful, stuck, timed out, fault, crashed, :data:`BAD_INPUT` or
        :data:`DIVERGED`. The last two end the exploration, and are not recorded in the graph.
    :param reason: the reason, in a sentence.
    :param seconds: the duration by the run's clock.
    :param violations: the violated properties.
    :param evaluated_names: the names of the properties that the run could have violated.
    :param is_given_up: whether the process of the run was killed, or died without a report.
    """

    outcome: str
    reason: str
    seconds: float
    violations: tuple[Violation, ...] = ()
    evaluated_names: tuple[str, ...] = ()
    is_given_up: bool = False


class GraphNode(Struct):
    """A choice point in a state.

    :param point: the choice point of the first run that reached the state.
    :param edge: the edge on which that run reached the point.
    :param fault_count: the number of faults of that run up to the point.
    """

    point: ChoicePoint
    edge: Edge
    fault_count: int


class Graph(Struct):
    """The explored graph.

    :param max_faults: the maximum number of faults in a run.
    :param depth: see :class:`~cxbridge_explore.bounds.Bounds`.
    :ivar leaves: the end of the run on an edge.
    :ivar links: the node to which an edge leads.
    :ivar open_edges: the unexplored edges, in the order of discovery.
    :ivar node_by_digest: the numbers of the nodes by the digests of their states, which are extended by the
        values that the bounds limit.
    :ivar unmerged_reasons: the reasons why states were not compared, in the order of discovery.
    :ivar used_parts: the parts of the agent that the runs have used, if recorded.
    """

    max_faults: int
    depth: int | None
    # msgspec copies empty defaults for each instance
    nodes: list[GraphNode] = []
    leaves: dict[Edge, Leaf] = {}
    links: dict[Edge, int] = {}
    open_edges: dict[Edge, None] = field(default_factory=lambda: {ROOT_EDGE: None})
    node_by_digest: dict[bytes, int] = {}
    unmerged_reasons: dict[str, None] = {}
    used_parts: set[UsedPart] = set()

    @property
    def merged_count(self) -> int:
        """The number of runs that have reached a known state."""
        return len(self.links) - len(self.nodes)  # the first run to a node was not merged

    @property
    def counts_text(self) -> str:
        """The numbers of runs, states and merged runs, with nouns."""
        runs, states = format_count(len(self.leaves), "run"), format_count(len(self.nodes), "state")
        return f"{runs}, {states}, {self.merged_count} merged"

    @property
    def open_branches_text(self) -> str:
        """How many branches are open, as a clause."""
        count = len(self.open_edges)
        return "1 branch is open" if count == 1 else f"{count} branches are open"

    # ---- reports of runs

    def record_choice_point(
        self, edge: Edge, point: ChoicePoint, digest: bytes, unmerged_reason: str
    ) -> int | None:
        """Record that the run on an open edge has reached a choice point.

        :param digest: the digest of the run's state; empty if the state cannot be compared.
        :param unmerged_reason: the reason for an empty digest; may be empty.
        :returns: the number of the new node, whose edges are now open; None if the state is known.
        """
        del self.open_edges[edge]
        if unmerged_reason:
            self.unmerged_reasons[unmerged_reason] = None
        faults = self.count_faults(edge)
        if digest:  # nodes are equal only if the bounds leave them the same options
            digest = b"%b %d %d" % (digest, faults, point.index if self.depth is not None else 0)
        equal_node = self.node_by_digest.get(digest)
        if equal_node is not None:
            self.links[edge] = equal_node
            return None
        number = len(self.nodes)
        self.nodes.append(GraphNode(point, edge, faults))
        self.links[edge] = number
        if digest:
            self.node_by_digest[digest] = number
        for option in self.allowed_options(number):
            self.open_edges[number, option] = None
        return number

    def record_end(self, edge: Edge, leaf: Leaf) -> None:
        """Record the end of the run on an open edge."""
        del self.open_edges[edge]
        self.leaves[edge] = leaf

    # ---- analysis

    def count_faults(self, edge: Edge) -> int:
        """Return the number of faults of a run on an edge."""
        number, option = edge
        if edge == ROOT_EDGE:
            return 0
        node = self.nodes[number]
        return node.fault_count + node.point.options[option].faults

    def next_point_index(self, edge: Edge) -> int:
        """Return the index, in a run on an edge, of the first choice point after the edge."""
        number, _ = edge
        return 0 if edge == ROOT_EDGE else self.nodes[number].point.index + 1

    def allowed_options(self, number: int) -> list[int]:
        """Return the indices of the options of a node within the bounds, the usual option first."""
        node = self.nodes[number]
        if self.depth is not None and node.point.index >= self.depth:
            return [USUAL]
        allowed_faults = self.max_faults - node.fault_count
        return [
            index
            for index, option in enumerate(node.point.options)
            if index == USUAL or option.faults <= allowed_faults
        ]

    def find_cycle_node(self) -> int | None:
        """Return the number of the first node of a cycle, or None. A run in a cycle never ends."""
        sorter: TopologicalSorter[int] = TopologicalSorter()
        for (number, _), target in self.links.items():
            sorter.add(target, number)
        try:
            sorter.prepare()
        except CycleError as error:
            _, nodes = error.args
            return int(min(nodes))
        return None

    def trace_choices(self, edge: Edge) -> list[Choice]:
        """Return the unusual choices of a run to an edge, in order."""
        choices = []
        while edge != ROOT_EDGE:
            number, option = edge
            node = self.nodes[number]
            if option != USUAL:
                choices.append(Choice(node.point, option))
            edge = node.edge
        return choices[::-1]

    def find_path(self, edge: Edge) -> ChoicePath:
        """Return the path of a run to an edge."""
        return make_path(self.trace_choices(edge))
