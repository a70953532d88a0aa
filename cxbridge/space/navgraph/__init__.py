"""Navigation graphs: named places, edges between them and shortest paths. See ``docs/features.md``."""

from cxbridge.space.navgraph.emitting import emit_navgraph
from cxbridge.space.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode, NavGraphPath
from cxbridge.space.navgraph.loading import load_navgraph, parse_navgraph

__all__ = [
    "NavGraph",
    "NavGraphEdge",
    "NavGraphNode",
    "NavGraphPath",
    "emit_navgraph",
    "load_navgraph",
    "parse_navgraph",
]
