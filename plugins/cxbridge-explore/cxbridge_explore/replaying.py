"""Explores without fork: each run begins at the beginning, one after the other."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.errors import CxbridgeError
from cxbridge_explore.graph import Edge, Graph, Leaf
from cxbridge_explore.playing import ExploredRun, MakeRun, failure
from cxbridge_explore.state import Digest, state_digest
from cxbridge_explore.worker import as_point
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, PathChooser


class _MergedError(BaseException):
    """The run has come to a state in which another one has been."""


class _FrontierChooser:
    """Takes the usual options, and leaves the other options open for later runs.

    :param edge: the open edge that the run is for.
    :param free: the number of the first choice point that is not on the way there.
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
    """Explore until no edge is open, or ``is_over`` is true, which is asked before each run.

    :param make: makes a run.
    :param merge: whether states are compared.
    :returns: why some states were not compared.
    :raises CxbridgeError: when the scenario is wrong.
    """
    hidden: dict[str, None] = {}
    while graph.open and not is_over():
        edge = next(reversed(graph.open))
        number = edge[0]
        chooser = _FrontierChooser(graph, edge, 0 if number < 0 else graph.nodes[number].point.index + 1)
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
    """Play a run; None when it was not played to its end."""
    try:
        return run.leaf()
    except _MergedError:
        return None
    except CxbridgeError:
        raise
    except Exception as error:  # noqa: BLE001 - an agent's Python may fail in any way
        return failure(error)
