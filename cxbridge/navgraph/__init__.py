"""Navigation graphs: named places, ways between them, and the shortest way. See ``docs/navgraph.md``."""

from cxbridge.navgraph.emitting import emit_navgraph
from cxbridge.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode, NavGraphPath
from cxbridge.navgraph.loading import load_navgraph, parse_navgraph

__all__ = [
    "NavGraph",
    "NavGraphEdge",
    "NavGraphNode",
    "NavGraphPath",
    "emit_navgraph",
    "load_navgraph",
    "parse_navgraph",
]
