"""Navigation graphs: places, ways, and what a graph file can say wrong."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import NavGraphError
from cxbridge.space.navgraph import NavGraph, NavGraphEdge, NavGraphNode, load_navgraph, parse_navgraph
from tests.support import FAWKES_DIR, ROBOTINO_DIR, needs_fawkes, needs_robotino

HOUSE = """\
%YAML 1.2
%TAG ! tag:fawkesrobotics.org,navgraph/
---
graph-name: House
default-properties:
  - travel_tolerance: 0.7
nodes:
  - name: hall
    pos: [0.0, 0.0]
  - name: kitchen
    pos: [4.0, 0.0]
    properties:
      - room
      - orientation: -1.57
  - name: garden
    pos: [4.0, 3.0]
    properties: [outside]
  - !unconnected
    name: moon
    pos: [0.0, 1.0]
connections:
  - [hall, kitchen]
  - [kitchen, garden]
  - !dir [garden, hall]
"""


@pytest.fixture
def house() -> NavGraph:
    return parse_navgraph(HOUSE, "house.yaml")


def names(path) -> list[str]:
    return [node.name for node in path.nodes]


def test_nodes_have_places_and_properties(house: NavGraph):
    kitchen = house.node("kitchen")
    assert kitchen == NavGraphNode("kitchen", 4.0, 0.0, {"room": "true", "orientation": "-1.57"})
    assert house.default_properties == {"travel_tolerance": "0.7"}
    assert house.node("cellar") is None
    assert [node.name for node in house.search_nodes("outside")] == ["garden"]


def test_the_closest_node(house: NavGraph):
    def closest(*args, **more):
        node = house.closest_node(*args, **more)
        return node and node.name

    assert closest(0.0, 0.9) == "hall"
    assert closest(0.0, 0.9, include_unconnected=True) == "moon"
    assert closest(0.0, 0.0, "room") == "kitchen"
    assert closest(0.0, 0.0, other_than="hall") == "kitchen"
    assert closest(0.0, 0.0, "nothing") is None


def test_the_shortest_way(house: NavGraph):
    path = house.search_path("hall", "garden")
    assert path is not None
    assert (names(path), path.cost) == (["hall", "kitchen", "garden"], 7.0)
    assert house.search_path("hall", "moon") is None
    assert house.neighbours("garden") == ("hall", "kitchen")
    assert house.edge("hall", "garden") is None


def test_a_blocked_edge_is_gone_round(house: NavGraph):
    house.block("garden", "hall")
    path = house.search_path("garden", "hall")
    assert path is not None
    assert names(path) == ["garden", "kitchen", "hall"]
    house.unblock("garden", "hall")
    path = house.search_path("garden", "hall")
    assert path is not None
    assert names(path) == ["garden", "hall"]
    # an edge that is made anew is not blocked
    house.block("garden", "hall")
    edge = house.edge("garden", "hall")
    assert edge
    house.remove_edge(edge)
    house.add_edge(edge)
    assert house.search_path("garden", "hall") == path
    with pytest.raises(NavGraphError, match="hall--garden does not exist"):
        house.block("hall", "garden")


def test_a_way_between_unknown_nodes(house: NavGraph):
    with pytest.raises(NavGraphError, match="no node 'cellar'") as caught:
        house.search_path("hall", "cellar")
    assert caught.value.hint == "there are: garden, hall, kitchen, moon"


places = st.lists(
    st.tuples(st.floats(-9, 9), st.floats(-9, 9)).map(lambda p: (round(p[0], 2), round(p[1], 2))),
    min_size=2, max_size=8, unique=True,
)  # fmt: skip


@given(places, st.data())
def test_no_way_is_shorter_than_the_one_found(points, data):
    """A* against trying all ways."""
    graph = NavGraph("random")
    for i, (x, y) in enumerate(points):
        graph.add_node(NavGraphNode(str(i), x, y))
    pairs = [(a, b) for a in range(len(points)) for b in range(a)]
    for a, b in data.draw(st.lists(st.sampled_from(pairs), unique=True)):
        graph.add_edge(NavGraphEdge(str(a), str(b), directed=data.draw(st.booleans())))

    best = math.inf

    def walk(name: str, cost: float, seen: frozenset[str]) -> None:
        nonlocal best
        if name == "0":
            best = min(best, cost)
        for other in graph.neighbours(name):
            if other not in seen:
                a, b = graph.node(name), graph.node(other)
                assert a
                assert b
                walk(other, cost + a.distance(b.x, b.y), seen | {other})

    walk("1", 0.0, frozenset("1"))
    path = graph.search_path("1", "0")
    assert (path.cost if path else math.inf) == pytest.approx(best)


CROSS = """\
graph-name: Cross
nodes:
  - {name: W, pos: [-1, 0]}
  - {name: E, pos: [1, 0]}
  - {name: S, pos: [0, -1]}
  - {name: N, pos: [0, 2]}
connections:
  - [W, E]
  - [E, S]
"""
TAG = "!<tag:fawkesrobotics.org,navgraph/"


def test_a_crossing_is_split():
    graph = parse_navgraph(f"{CROSS}  - {TAG}split-intersection> [S, N]\n", "cross.yaml")
    assert [node.name for node in graph.nodes][4:] == ["U-0"]
    assert graph.neighbours("U-0") == ("E", "N", "S", "W")
    assert graph.edge("W", "E") is None


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("graph-name: House", "name: House", 4, "no 'graph-name'"),
        ("pos: [4.0, 0.0]", "pos: [4.0]", 11, "'pos' must be [x, y]"),
        ("pos: [4.0, 0.0]", "pos: [4.0, far]", 11, "'far' is not a number"),
        ("pos: [4.0, 0.0]", "pos: [4.0, .nan]", 11, "'.nan' is not a number"),
        ("name: garden", "name: hall", 15, "Node with name hall already exists"),
        ("[hall, kitchen]", "[hall, cellar]", 22, "Node 'cellar' for edge 'hall' -> 'cellar' does not exist"),
        ("[hall, kitchen]", "[hall, moon]", 22, "marked unconnected"),
        ("[hall, kitchen]", "[hall]", 22, "a connection must be [FROM, TO]"),
        ("!dir [garden, hall]", "[hall, kitchen]", 24, "Edge from hall to kitchen already exists"),
        ("!unconnected\n    name: moon", "name: moon", 4, "moon cannot be reached from 'hall'"),
        ("properties: [outside]", "properties: outside", 17, "'properties' must be a list"),
        ("properties: [outside]", "properties: [insert-mode: closest-node]", 15, "is not supported"),
        ("nodes:", "nodes: [", 7, "not valid YAML"),
        ("- name: hall", "- hall", 8, "not valid YAML"),
    ],
)
def test_a_mistake_in_a_graph_file_has_its_line(old: str, new: str, line: int, message: str):
    assert old in HOUSE
    with pytest.raises(NavGraphError) as caught:
        parse_navgraph(HOUSE.replace(old, new), "house.yaml")
    assert message in caught.value.message
    assert caught.value.file == "house.yaml"
    if "YAML" not in message:
        assert caught.value.line == line


def test_crossing_edges_are_a_mistake_unless_said_otherwise():
    with pytest.raises(NavGraphError, match="S-N: it intersects with W-E") as caught:
        parse_navgraph(f"{CROSS}  - [S, N]\n", "cross.yaml")
    assert caught.value.line == 10


@needs_fawkes
def test_the_example_of_fawkes():
    assert FAWKES_DIR is not None
    graph = load_navgraph(FAWKES_DIR / "cfg" / "navgraph-example.yaml")
    back = graph.search_path("M3", "Origin")
    assert back is not None
    assert names(back) == ["M3", "M1", "Origin"]


@needs_robotino
@pytest.mark.parametrize("name", ["basis", "grasping-challenge", "llsf", "vs-evaluation"])
def test_the_graphs_of_the_rcll_agent(name: str):
    assert ROBOTINO_DIR is not None
    graph = load_navgraph(ROBOTINO_DIR / "cfg" / f"navgraph-{name}.yaml")
    assert len(graph.nodes) > 20
