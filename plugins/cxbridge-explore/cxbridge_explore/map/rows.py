"""The runs of an exploration as rows of a map. A row starts where its run branches off another run."""

from __future__ import annotations

from dataclasses import dataclass

from cxbridge_explore.graph import ROOT_EDGE, Edge, Graph, Leaf
from cxbridge_explore.worlds.points import USUAL

MERGED, OPEN = "merged", "open"  # outcomes of rows without an end of a run


@dataclass(slots=True)
class MapRow:
    """A run, from the point where it branches off another run.

    :param choice: the chosen option in words; empty for the usual run.
    :param begin_s: the time of the branch, by the run's clock.
    :param faults: the number of faults of the run up to the branch, that of the branch included.
    :param end_s: the time of the end; for an open row, the time of the branch.
    :param outcome: the outcome; ``merged`` if the run reached a known state, ``open`` if its rest is
        unexplored.
    :param reason: the reason for the outcome in a sentence; empty for an open row.
    :param parent: the number of the row from which the run branches off; None for the usual run.
    :param path: all unusual choices of the run, in words.
    :param violations: the violated properties, each as ``NAME: MESSAGE``.
    :param edge: the last edge of the run.
    """

    choice: str
    begin_s: float
    faults: int
    parent: int | None
    path: tuple[str, ...]
    end_s: float = 0.0
    outcome: str = OPEN
    reason: str = ""
    violations: tuple[str, ...] = ()
    edge: Edge = ROOT_EDGE


def make_run_rows(graph: Graph) -> list[MapRow]:
    """Return the rows, each below its parent. Later branches of a run come first.

    In this order, no line from a row to its parent crosses another row.
    """
    rows: list[MapRow] = []
    # each edge with the number of the row from which its run branches off
    pending_edges: list[tuple[Edge, int | None]] = [(ROOT_EDGE, None)]
    while pending_edges:
        edge, parent = pending_edges.pop()
        number = len(rows)
        row = _begin_row(graph, edge, parent, rows)
        rows.append(row)
        # The row ends at a node that another run has reached first, since the run was merged there.
        while edge in graph.links and graph.nodes[graph.links[edge]].edge == edge:
            node = graph.links[edge]
            unusual_options = [option for option in graph.allowed_options(node) if option != USUAL]
            pending_edges += [((node, option), number) for option in unusual_options]
            edge = node, USUAL
        _end_row(graph, edge, row)
    return rows


def _begin_row(graph: Graph, edge: Edge, parent: int | None, rows: list[MapRow]) -> MapRow:
    if parent is None:
        return MapRow(choice="", begin_s=0.0, faults=0, parent=None, path=())
    number, option = edge
    point = graph.nodes[number].point
    choice = f"{point.subject}: {point.options[option].name}"
    path = (*rows[parent].path, f"{choice} at {point.seconds:.2f} s")
    return MapRow(choice, point.seconds, graph.count_faults(edge), parent, path, end_s=point.seconds)


def _end_row(graph: Graph, edge: Edge, row: MapRow) -> None:
    row.edge = edge
    leaf: Leaf | None = graph.leaves.get(edge)
    if leaf is not None:
        row.end_s, row.outcome, row.reason = leaf.seconds, leaf.outcome, leaf.reason
        row.violations = tuple(f"{violation.property}: {violation.message}" for violation in leaf.violations)
    elif edge in graph.links:
        point = graph.nodes[graph.links[edge]].point
        row.end_s, row.outcome = point.seconds, MERGED
        row.reason = f"continues like another run from {point.subject} on"
