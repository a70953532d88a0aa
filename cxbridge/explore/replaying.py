"""Explores without fork: each run begins at the beginning, one after the other."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.errors import CxbridgeError
from cxbridge.explore.graph import Edge, Graph, Leaf
from cxbridge.explore.playing import MakeRun, failure
from cxbridge.explore.worker import as_point
from cxbridge.worlds.points import USUAL, ChoicePoint, PathChooser


class _MergedError(Exception):
    """The run has come to a state in which another one has been."""


class _FrontierChooser:
    """Takes the usual options, and leaves the others open for later runs.

    :param edge: the open edge that the run is for.
    :param free: the number of the first choice point that is not on the way there.
    """

    def __init__(self, graph: Graph, edge: Edge, free: int) -> None:
        self.edge = edge
        self._graph = graph
        self._free = free

    def choose(self, index: int, point: ChoicePoint) -> int:
        if index < self._free:
            return USUAL
        number = self._graph.reached(self.edge, as_point(index, point), b"")
        if number is None:
            raise _MergedError
        self.edge = number, USUAL
        return USUAL


def explore_by_replay(make: MakeRun, graph: Graph, is_over: Callable[[], bool]) -> None:
    """Explore until no edge is open, or ``is_over`` is true, which is asked before each run.

    :param make: makes a run.
    :raises CxbridgeError: when the scenario is wrong.
    """
    while graph.open and not is_over():
        edge = next(reversed(graph.open))
        number = edge[0]
        chooser = _FrontierChooser(graph, edge, 0 if number < 0 else graph.nodes[number].point.index + 1)
        leaf = _play(make, PathChooser(graph.path_to(edge), chooser))
        if leaf is not None:
            graph.ended(chooser.edge, leaf)


def _play(make: MakeRun, chooser: PathChooser) -> Leaf | None:
    """Play a run; None when it was not played to its end."""
    run = make(chooser)
    try:
        return run.leaf()
    except _MergedError:
        return None
    except CxbridgeError:
        raise
    except Exception as error:  # noqa: BLE001 - an agent's Python may fail in any way
        return failure(error)
    finally:
        run.close()
