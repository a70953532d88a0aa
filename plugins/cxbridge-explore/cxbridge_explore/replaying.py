"""Explores without forking: plays the runs one after the other, each from the beginning."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.errors import CxbridgeError
from cxbridge_explore.graph import Edge, Graph, Leaf
from cxbridge_explore.playing import ExploredRun, MakeRun, make_failure_leaf
from cxbridge_explore.state import ComputeDigest, make_digest_function
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, PathChooser


class _MergedError(BaseException):
    """The run has reached a known state.

    Not an `Exception`, since code of the agent or of the executive may catch an `Exception` of a choice.
    """


class _ReportingChooser:
    """Takes the usual options, and adds each choice point to the graph, where its other options stay open.

    :param edge: the open edge to explore.
    :param compute_digest: computes the digest of a state.
    :ivar edge: the open edge of the run.
    """

    def __init__(self, graph: Graph, edge: Edge, compute_digest: ComputeDigest) -> None:
        self.edge = edge
        self._graph = graph
        self._first_reported_index = graph.next_point_index(edge)
        self._compute_digest = compute_digest

    def choose(self, point: ChoicePoint) -> int:
        if point.index < self._first_reported_index:
            return USUAL  # the graph has this point of the path already
        number = self._graph.record_choice_point(
            self.edge, point.without_data(), *self._compute_digest(point)
        )
        if number is None:
            raise _MergedError
        self.edge = number, USUAL
        return USUAL


def explore_by_replay(
    make_run: MakeRun, graph: Graph, is_over: Callable[[], bool], *, merges_states: bool
) -> None:
    """Explore until no edge is open, or ``is_over`` returns True before a run.

    :param merges_states: whether to compare states.
    """
    while graph.open_edges and not is_over():
        edge = next(reversed(graph.open_edges))  # depth-first, as with processes
        path = graph.find_path(edge)
        with make_run(PathChooser(path)) as run:
            # The run follows the path to the edge, and explores the usual options from there on.
            chooser = _ReportingChooser(graph, edge, make_digest_function(run, merges_states=merges_states))
            run.choices.chooser = PathChooser(path, chooser)
            leaf = _play_run(run)
            graph.used_parts.update(run.collect_used_parts())
        if leaf is not None:
            graph.record_end(chooser.edge, leaf)


def _play_run(run: ExploredRun) -> Leaf | None:
    """Play a run and return its end; None if the run reached a known state.

    :raises CxbridgeError: if the agent is broken, or the run diverges from its path.
    """
    try:
        return run.play_to_leaf()
    except _MergedError:
        return None
    except CxbridgeError:
        raise  # an invalid scenario ends the exploration, unlike an exception in one of its runs
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        return make_failure_leaf(error)
