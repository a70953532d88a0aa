"""Explores without fork: the runs are played one after the other, each from the beginning."""

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
    :param first_reported: the number of the first choice point after the edge.
    """

    def __init__(self, graph: Graph, edge: Edge, first_reported: int) -> None:
        self.edge = edge
        self.digest: Digest = lambda _: (b"", "")  # replaced as soon as the run is made
        self.unmerged_reason = ""
        self._graph = graph
        self._first_reported = first_reported

    def choose(self, index: int, point: ChoicePoint) -> int:
        if index < self._first_reported:
            return USUAL
        digest, self.unmerged_reason = self.digest(point)
        number = self._graph.record_choice_point(self.edge, as_point(index, point), digest)
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
    unmerged_reasons: dict[str, None] = {}
    while graph.open and not is_over():
        edge = next(reversed(graph.open))  # depth-first, as with processes
        chooser = _ReportingChooser(graph, edge, graph.point_number(edge))
        # The chooser follows the path to the edge, and explores the usual options from there on.
        with make(PathChooser(graph.path_to(edge), chooser)) as run:
            chooser.digest = state_digest(run, merge=merge)
            leaf = _play(run)
            graph.used.update(run.used())
        if leaf is not None:
            graph.record_end(chooser.edge, leaf)
        if chooser.unmerged_reason:
            unmerged_reasons[chooser.unmerged_reason] = None
    return tuple(unmerged_reasons)


def _play(run: ExploredRun) -> Leaf | None:
    """Play a run and return its end; None if the run reached a known state.

    :raises CxbridgeError: if the agent is broken, or the run diverges from its path.
    """
    try:
        return run.leaf()
    except _MergedError:
        return None
    except CxbridgeError:
        raise  # ends the exploration
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        return failure(error)
