"""Frames and navigation graphs as numbers and texts for Lua."""

from __future__ import annotations

from cxbridge.skiller.lua.placeaccess import make_place_functions
from cxbridge.space.navgraph import NavGraph, NavGraphEdge, NavGraphNode


def test_place_functions_return_numbers_and_texts() -> None:
    graph = NavGraph("house", {"colour": "white"})
    for name, x in (("a", 0.0), ("b", 3.0)):
        graph.add_node(NavGraphNode(name, x, 0.0, {"width": "1.5m", "open": "yes"}))
    graph.add_edge(NavGraphEdge("a", "b"))
    call = {name: (lambda *args, f=f: f(*args)[1:]) for name, f in make_place_functions(None, graph).items()}
    assert call["nav_path"]("a", "b") == (3.0, "a", "b")
    assert call["nav_closest"](2.0, 0.0, "", False, "b") == call["nav_node"]("a") == ("a", 0.0, 0.0)
    assert (call["nav_search"]("open"), call["nav_reachable"]("a")) == (("a", "b"), ("b",))
    assert (call["nav_name"](), call["nav_default"]("colour")) == (("house",), ("white",))
    width = call["nav_property"]("a", "width")[0]
    assert [call["nav_convert"](kind, width)[0] for kind in ("float", "int", "bool")] == [1.5, 1, False]
    assert "nav_name" not in make_place_functions(None, None)
