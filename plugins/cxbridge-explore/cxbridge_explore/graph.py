"""The explored graph: the states in which the world had a choice, and where each option has led.

A node is a choice point in a state; an edge is an option that was taken there. A run that is under way is on
exactly one open edge, so whatever becomes of its process, the open edges are the remaining work.
The counts depend on the graph alone, and not on the order in which it was found.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from msgspec import Struct

from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.use import Used
from cxbridge_explore.worlds.points import USUAL, ChoicePath, Step

ROOT: Final = (-1, USUAL)
"""The edge on which each run begins."""

BAD_INPUT: Final = "bad input"
"""The outcome of a run whose scenario is wrong: it ends the exploration."""

DIVERGED: Final = "diverged"
"""The outcome of a run that had other choice points than the run before on the same path."""

Edge = tuple[int, int]
"""A node's number, and the option that is taken there."""


class Way(Struct, frozen=True):
    """An option of a choice point.

    :param name: what paths call it.
    :param faults: how many faults it uses up.
    """

    name: str
    faults: int


class Point(Struct, frozen=True):
    """A choice point as the graph keeps it.

    :param index: its number in the run, from 0.
    :param kind: the kind of the choice.
    :param subject: its subject in particular.
    :param seconds: the time, by the run's clock.
    :param ways: its options.
    """

    index: int
    kind: str
    subject: str
    seconds: float
    ways: tuple[Way, ...]


class Leaf(Struct, frozen=True):
    """How a run ended.

    :param outcome: a word: completed, unsuccessful, stuck, timed out, fault, crashed.
    :param reason: why, in a sentence.
    :param seconds: how long it took, by its clock.
    :param violations: the properties that it does not have.
    :param evaluated: the names of the properties that it could have violated.
    :param is_given_up: whether its process was ended, or has died, before it could say.
    """

    outcome: str
    reason: str
    seconds: float
    violations: tuple[Violation, ...] = ()
    evaluated: tuple[str, ...] = ()
    is_given_up: bool = False


class GraphNode(Struct):
    """A choice point in a state.

    :param point: as the first run that came here has seen it.
    :param edge: by which that run came.
    :param faults: how many faults it had met.
    :param share: the part of the whole tree of runs below, if all options of a node lead to equally many.
    """

    point: Point
    edge: Edge
    faults: int
    share: float


class SavedGraph(Struct, frozen=True):
    """A graph as a file can have it; see :class:`Graph`."""

    nodes: list[GraphNode]
    leaves: list[tuple[Edge, Leaf]]
    links: list[tuple[Edge, int]]
    open: list[Edge]
    known: dict[bytes, int]
    used: list[Used]


class Graph:
    """The known graph of the runs' choices.

    :param faults: how many faults a run may meet.
    :param depth: at how many choice points options other than the usual one are taken; None: at all.
    """

    def __init__(self, faults: int, depth: int | None) -> None:
        self.nodes: list[GraphNode] = []
        self.leaves: dict[Edge, Leaf] = {}
        self.links: dict[Edge, int] = {}
        """Where the edges lead that end at a node."""
        self.open: dict[Edge, None] = {ROOT: None}
        """The edges of which it is not known where they lead, in the order in which they were found."""
        self.merged = 0
        """How many runs have come to a node where another one had been."""
        self.used: set[Used] = set()
        """The parts of the agent that the runs have used, if that is noted."""
        self.explored = 0.0
        """The share of the tree of runs whose end is known: Knuth's estimate."""
        self._faults = faults
        self._depth = depth
        self._known: dict[bytes, int] = {}

    def save(self) -> SavedGraph:
        """Return it as a file can have it."""
        return SavedGraph(
            self.nodes,
            list(self.leaves.items()),
            list(self.links.items()),
            list(self.open),
            self._known,
            sorted(self.used),
        )

    def load(self, saved: SavedGraph) -> None:
        """Take over what another graph with the same bounds has had."""
        self.nodes = saved.nodes
        self.leaves = dict(saved.leaves)
        self.links = dict(saved.links)
        self.open = dict.fromkeys(saved.open)
        self._known = saved.known
        self.used = set(saved.used)
        self.merged = len(self.links) - len(self.nodes)
        self.explored = 1.0 - sum(map(self._share, self.open))

    # ---- what runs report

    def reached(self, edge: Edge, point: Point, digest: bytes) -> int | None:
        """Note that the run on an open edge has come to a choice point.

        :param digest: of its state; empty: the state is not compared.
        :returns: the new node, whose edges are open now; None when another run has been in that state.
        """
        del self.open[edge]
        faults = self.faults_of(edge)
        if digest:  # states are equal when the bounds leave them the same ways, too
            digest = b"%b %d %d" % (digest, faults, point.index if self._depth is not None else 0)
        known = self._known.get(digest) if digest else None
        if known is not None:
            self.links[edge] = known
            self.merged += 1
            self.explored += self._share(edge)
            return None
        number = len(self.nodes)
        self.nodes.append(GraphNode(point, edge, faults, self._share(edge)))
        self.links[edge] = number
        if digest:
            self._known[digest] = number
        for option in self.options(number):
            self.open[number, option] = None
        return number

    def ended(self, edge: Edge, leaf: Leaf) -> None:
        """Note that the run on an open edge has come to its end."""
        del self.open[edge]
        self.leaves[edge] = leaf
        self.explored += self._share(edge)

    # ---- what follows

    def faults_of(self, edge: Edge) -> int:
        """Return how many faults a run has met that takes an edge."""
        number, option = edge
        if number < 0:
            return 0
        node = self.nodes[number]
        return node.faults + node.point.ways[option].faults

    def _share(self, edge: Edge) -> float:
        number = edge[0]
        return 1.0 if number < 0 else self.nodes[number].share / len(self.options(number))

    def options(self, number: int) -> list[int]:
        """Return the options that are to be taken at a node; the usual one is the first."""
        node = self.nodes[number]
        if self._depth is not None and node.point.index >= self._depth:
            return [USUAL]
        left = self._faults - node.faults
        return [option for option, way in enumerate(node.point.ways) if option == USUAL or way.faults <= left]

    def cycles(self) -> list[int]:
        """Return a node of each part of the graph in which a run can go round without end, by number."""
        below: dict[int, list[int]] = {}
        for (number, _), target in self.links.items():
            below.setdefault(number, []).append(target)
        left = {number: len(set(targets)) for number, targets in below.items()}
        above: dict[int, set[int]] = {}
        for number, targets in below.items():
            for target in targets:
                above.setdefault(target, set()).add(number)
        ends = [number for number in range(len(self.nodes)) if number not in left]
        while ends:  # remove nodes that lead to ends only; the rest lies on cycles, or leads to one
            for number in above.get(ends.pop(), ()):
                left[number] -= 1
                if not left[number]:
                    ends.append(number)
        endless = {number for number, count in left.items() if count and number >= 0}
        return self._entries(endless, below)

    @staticmethod
    def _entries(endless: set[int], below: dict[int, list[int]]) -> list[int]:
        """Return a node of each cycle, the first that was found."""
        found = []
        done: set[int] = set()
        for number in sorted(endless):
            reached: set[int] = set()
            waiting = [number]
            while waiting:
                for target in below.get(waiting.pop(), ()):
                    if target in endless and target not in reached:
                        reached.add(target)
                        waiting.append(target)
            if number in reached and not done & reached:
                found.append(number)
                done |= reached
        return found

    def edges_to(self, edge: Edge) -> list[Edge]:
        """Return the edges of the run that found an edge, from its first choice to this one."""
        found = []
        while edge != ROOT:
            found.append(edge)
            edge = self.nodes[edge[0]].edge
        return found[::-1]

    def path_to(self, edge: Edge) -> ChoicePath:
        """Return the path of choices that leads a run onto an edge."""
        return {
            node.point.index: Step(node.point.subject, node.point.ways[option].name)
            for node, option in self._choices(edge)
            if option != USUAL
        }

    def choices_to(self, edge: Edge) -> list[dict[str, object]]:
        """Return the choices on the way to an edge that are not usual, as JSON can have them."""
        return [
            {
                "index": node.point.index,
                "kind": node.point.kind,
                "subject": node.point.subject,
                "option": node.point.ways[option].name,
                "seconds": round(node.point.seconds, 6),
            }
            for node, option in self._choices(edge)
            if option != USUAL
        ]

    def _choices(self, edge: Edge) -> Iterator[tuple[GraphNode, int]]:
        for number, option in self.edges_to(edge):
            yield self.nodes[number], option
