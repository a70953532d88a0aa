"""The feature `navgraph` as rules see it."""

from __future__ import annotations

import pytest

from cxbridge.errors import NavGraphError
from cxbridge.events import Level
from cxbridge.executive.features.navgraph import NavGraphFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.space.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode


@pytest.fixture
def graph():
    graph = NavGraph("House", {"speed": "0.5"})
    graph.add_node(NavGraphNode("hall", 0, 0, {"room": "true", "n": "4"}))
    graph.add_node(NavGraphNode("kitchen", 4.00000049, 0, {"speed": "1.5"}))
    graph.add_node(NavGraphNode("bath", 0, 1))
    graph.add_edge(NavGraphEdge("hall", "kitchen", properties={"b": "2", "a": "1"}))
    graph.add_edge(NavGraphEdge("kitchen", "bath", directed=True))
    graph.add_edge(NavGraphEdge("hall", "bath"))
    return graph


def make_manager(bus, graph):
    manager = EnvironmentManager(bus, [NavGraphFeature(graph)])
    env = manager.create("executive")
    assert manager.request("executive", "navgraph") == "TRUE"
    return manager, env


@pytest.fixture
def nav(bus, graph, log):
    manager, env = make_manager(bus, lambda: graph)
    yield env
    manager.close()


def slots_of(env, template):
    return [slots for _, _, slots in env.facts(template)]


def test_graph_becomes_facts(nav):
    assert slots_of(nav, "navgraph") == [{"name": "House"}]
    hall, kitchen, bath = slots_of(nav, "navgraph-node")
    assert hall == {
        "name": "hall",
        "pos": (0.0, 0.0),
        "properties": ("n", "4", "room", "true", "speed", "0.5"),
    }
    assert kitchen == {"name": "kitchen", "pos": (4.0, 0.0), "properties": ("speed", "1.5")}
    assert bath["properties"] == ("speed", "0.5")
    edges = slots_of(nav, "navgraph-edge")
    assert edges[0] == {
        "from": "hall",
        "to": "kitchen",
        "directed": "FALSE",
        "properties": ("a", "1", "b", "2"),
    }
    assert [edge["directed"] for edge in edges] == ["FALSE", "TRUE", "FALSE"]


def test_unchanged_graph_keeps_facts(bus, graph):
    manager, env = make_manager(bus, lambda: graph)
    before = [index for index, _, _ in env.facts("navgraph-node")]
    manager.before_run("executive")
    assert [index for index, _, _ in env.facts("navgraph-node")] == before
    graph.add_node(NavGraphNode("attic", 0, 9))
    manager.before_run("executive")
    assert "attic" in {node["name"] for node in slots_of(env, "navgraph-node")}
    manager.close()


def test_unreadable_graph_is_reported(bus, log):
    def fail():
        raise NavGraphError('there is no "House"')

    manager, env = make_manager(bus, fail)
    (fact,) = slots_of(env, "navgraph-load-fail")
    assert fact["implied"] == ('there is no "House"',)
    assert log.texts(Level.WARN) == ['Failed to assert navgraph: there is no "House"']
    env.call("navgraph-block-edge", "a", "b")
    assert "does not exist in graph" in log.texts(Level.WARN)[1]
    manager.before_run("executive")
    manager.close()


def test_blocked_edges_are_not_used(nav, graph):
    nav.call("navgraph-block-edge", "hall", "bath")
    path = graph.search_path("hall", "bath")
    assert [node.name for node in path.nodes] == ["hall", "kitchen", "bath"]
    assert graph.search_path("bath", "hall") is None
    nav.call("navgraph-unblock-edge", "hall", "bath")
    assert [node.name for node in graph.search_path("bath", "hall").nodes] == ["bath", "hall"]


def test_blocking_of_missing_edge_is_a_warning(nav, log):
    nav.call("navgraph-block-edge", "bath", "hall")
    nav.call("navgraph-unblock-edge", "hall", "moon")
    assert log.texts(Level.WARN) == [
        "Environment executive tried to block edge bath--hall, which does not exist in graph",
        "Environment executive tried to unblock edge hall--moon, which does not exist in graph",
    ]


@pytest.mark.parametrize(
    ("call", "value"),
    [
        ("(navgraph-pos-x (create$ 1.0 2.0))", 1.0),
        ("(navgraph-pos-y (create$ 1.0 2.0))", 2.0),
        ("(navgraph-pos-distance (create$ 1.0 2.0) (create$ 4.0 6.0))", 5.0),
        ("(navgraph-closer (create$ 0 0) (create$ 1 0) (create$ 2 0))", "TRUE"),
        ("(navgraph-closer (create$ 0 0) (create$ 2 0) (create$ 2 0))", "FALSE"),
        ("(navgraph-closest-to (create$ 3.0 0.0))", "kitchen"),
        ("(navgraph-closest-to (create$ 4.0 0.0))", "hall"),
        ('(navgraph-closest-by-name "hall")', "bath"),
        ('(navgraph-closest-by-name "moon")', "FALSE"),
        ('(navgraph-has-property (create$ "a" "b") "a")', "TRUE"),
        ('(navgraph-has-property (create$ "a" "b") "b")', "FALSE"),
        ('(navgraph-property (create$ "a" "b" "c" "d") "c")', "d"),
        ('(navgraph-property (create$ "a" "b") "d")', "FALSE"),
        ('(navgraph-property-as-float (create$ "a" "1") "a")', 1.0),
        ('(navgraph-property-as-float (create$) "a")', 0.0),
        ('(navgraph-property-as-int (create$ "a" "1.9") "a")', 1),
        ('(navgraph-property-as-int (create$) "a")', 0),
        ('(navgraph-property-as-bool (create$ "a" "true") "a")', "TRUE"),
        ('(navgraph-property-as-bool (create$ "a" "yes") "a")', "FALSE"),
        ('(navgraph-property-as-bool (create$) "a")', "FALSE"),
    ],
)
def test_functions_of_library(nav, call, value):
    assert nav.eval(call) == value


def test_directed_edge_is_blocked(nav, graph):
    nav.call("navgraph-block-edge", "kitchen", "bath")
    path = graph.search_path("kitchen", "bath")
    assert [node.name for node in path.nodes] == ["kitchen", "hall", "bath"]
