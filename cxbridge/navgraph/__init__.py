"""Navigation graphs: named places, ways between them, and the shortest way. See ``docs/navgraph.md``."""

from cxbridge.navgraph.graph import Edge, NavGraph, Node, Path
from cxbridge.navgraph.loading import load_navgraph, parse_navgraph

__all__ = ["Edge", "NavGraph", "Node", "Path", "load_navgraph", "parse_navgraph"]
