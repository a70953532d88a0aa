"""Explores without fork: each run starts from the beginning, one after the other."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.errors import CxbridgeError
from cxbridge_explore.graph import Edge, Graph, Leaf
from cxbridge_explore.playing import ExploredRun, MakeRun, failure
from cxbridge_explore.state import Digest, state_digest
from cxbridge_explore.worker import as_point
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, PathChooser


class _MergedError(BaseException):
    """The run has reached a known state. Not an `Exception`, which code around the choice may catch."""


class _ReportingChooser:
    """Takes the usual options, reports each choice point to the graph, and leaves its further options open.

    :param edge: the open edge to explore.
    :param free: the number of the first choice point after the edge.
    """

    def __init__(self, graph: Graph, edge: Edge, free: int) -> None:
        self.edge = edge
        self.digest: Digest = lambda _: (b"", "")
        self.hidden = ""
        self._graph = graph
        self._free = free

    def choose(self, index: int, point: ChoicePoint) -> int:
        if index < self._free:
            return USUAL
        digest, self.hidden = self.digest(point)
        number = self._graph.reached(self.edge, as_point(index, point), digest)
        if number is None:
            raise _MergedError
        self.edge = number, USUAL
        return USUAL


def explore_by_replay(
    make: MakeRun, graph: Graph, is_over: Callable[[], bool], *, merge: bool
) -> tuple[str, ...]:
    """Explore until no edge is open or ``is_over`` returns True before a run.

    :param merge: whether to compare states.
    :returns: the reasons why states were not compared.
    """
    hidden: dict[str, None] = {}
    while graph.open and not is_over():
        edge = next(reversed(graph.open))  # depth-first, as with processes
        number = edge[0]
        chooser = _ReportingChooser(graph, edge, 0 if number < 0 else graph.nodes[number].point.index + 1)
        # The chooser follows the path to the edge, and explores the usual options from there on.
        with make(PathChooser(graph.path_to(edge), chooser)) as run:
            chooser.digest = state_digest(run, merge=merge)
            leaf = _play(run)
            graph.used.update(run.used())
        if leaf is not None:
            graph.ended(chooser.edge, leaf)
        if chooser.hidden:
            hidden[chooser.hidden] = None
    return tuple(hidden)


def _play(run: ExploredRun) -> Leaf | None:
    """Play a run; None if it reached a known state."""
    try:
        return run.leaf()
    except _MergedError:
        return None
    except CxbridgeError:
        raise
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        return failure(error)
