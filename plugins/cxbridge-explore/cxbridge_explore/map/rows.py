"""The runs of an exploration as rows: each begins where it left another one, and ends with an outcome."""

from __future__ import annotations

from dataclasses import dataclass, field

from cxbridge_explore.graph import ROOT, Edge, Graph, Leaf
from cxbridge_explore.worlds.points import USUAL

MERGED, OPEN = "merged", "open"


@dataclass(slots=True)
class MapRow:
    """A run from the choice on at which it differs from the one that it left.

    :param choice: the chosen option, in words; empty for the usual run.
    :param begin_s: the time by the run's clock, and ``end_s`` when it ended.
    :param outcome: how it ended; ``merged``: in a state in which another run had been; ``open``: it is not
        explored.
    :param reason: why, in a sentence.
    :param parent: the number of the row that it left; None for the usual run.
    :param path: all choices on its way that are not usual, in words.
    """

    choice: str
    begin_s: float
    faults: int
    parent: int | None
    path: tuple[str, ...]
    end_s: float = 0.0
    outcome: str = OPEN
    reason: str = ""
    violations: tuple[str, ...] = field(default=())


def run_rows(graph: Graph) -> list[MapRow]:
    """Return the runs, each below the one that it left; those that left last come first.

    So no line from a run to the row that it left crosses another row's.
    """
    rows: list[MapRow] = []
    waiting: list[tuple[Edge, int | None]] = [(ROOT, None)]
    while waiting:
        edge, parent = waiting.pop()
        number = len(rows)
        row = _begun(graph, edge, parent, rows)
        rows.append(row)
        while edge in graph.links and graph.nodes[graph.links[edge]].edge == edge:
            node = graph.links[edge]
            others = [option for option in graph.options(node) if option != USUAL]
            waiting += [((node, option), number) for option in others]
            edge = node, USUAL
        _end(graph, edge, row)
    return rows


def _begun(graph: Graph, edge: Edge, parent: int | None, rows: list[MapRow]) -> MapRow:
    if parent is None:
        return MapRow("", 0.0, 0, None, ())
    node, option = graph.nodes[edge[0]], edge[1]
    point = node.point
    choice = f"{point.subject}: {point.ways[option].name}"
    path = (*rows[parent].path, f"{choice} at {point.seconds:.2f} s")
    return MapRow(choice, point.seconds, graph.faults_of(edge), parent, path)


def _end(graph: Graph, edge: Edge, row: MapRow) -> None:
    leaf: Leaf | None = graph.leaves.get(edge)
    if leaf is not None:
        row.end_s, row.outcome, row.reason = leaf.seconds, leaf.outcome, leaf.reason
        row.violations = tuple(f"{each.property}: {each.message}" for each in leaf.violations)
    elif edge in graph.links:
        known = graph.nodes[graph.links[edge]].point
        row.end_s, row.outcome = known.seconds, MERGED
        row.reason = f"from {known.subject} on as another run"
    else:
        row.end_s = row.begin_s
