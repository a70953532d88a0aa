"""Navgraph files, and the shortest way."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.skiller.navigation.graphfile import load_navgraph
from cxbridge.skiller.navigation.navgraph import NavGraph, Node
from tests.support import FAWKES_DIR, needs_fawkes

FILE = """
%YAML 1.2
%TAG ! tag:fawkesrobotics.org,navgraph/
---
graph-name: test
nodes:
  - {name: a, pos: [0.0, 0.0]}
  - {name: b, pos: [1, 0]}
  - name: c
    pos: [1.0, 1.0]
    properties:
      - travel_tolerance: 0.7
      - orientation: 1.57
  - {name: far, pos: [9.0, 9.0]}
connections:
  - [a, b]
  - [b, c]
  - !dir [c, a]
"""


@pytest.fixture
def write(tmp_path):
    def make(text):
        (tmp_path / "graph.yaml").write_text(text.lstrip())
        return tmp_path / "graph.yaml"

    return make


def names(way):
    return [node.name for node in way]


def test_a_file_in_fawkes_layout(write):
    graph = load_navgraph(write(FILE))
    assert graph.nodes["b"] == Node("b", 1.0, 0.0)
    assert graph.nodes["c"].orientation == 1.57
    assert names(graph.path("a", "c")) == ["b", "c"]
    assert names(graph.path("c", "a")) == ["a"]
    assert names(graph.path("b", "b")) == ["b"]


def test_no_way_and_no_place(write):
    graph = load_navgraph(write(FILE))
    with pytest.raises(SkillError, match="no way from a to far"):
        graph.path("a", "far")
    with pytest.raises(SkillError, match=r"no place 'nowhere'(.|\n)*there are: a, b, c, far"):
        graph.path("a", "nowhere")


def test_without_connections_everything_is_near(write):
    graph = load_navgraph(write(FILE.partition("connections")[0]))
    assert names(graph.path("a", "far")) == ["far"]


@pytest.mark.parametrize(
    ("old", "new", "message", "line"),
    [
        ("[1, 0]", "[1]", "needs a position", 6),
        ("[1, 0]", "[1, x]", "must be a number", 6),
        ("[1, 0]", "[1, .inf]", "must be a number", 6),
        ("name: b", "nam: b", "needs a name", 6),
        ("name: b", "name: a", "two nodes 'a'", 6),
        ("- [b, c]", "- [b]", "has two ends", 15),
        ("- [b, c]", "- [b, z]", "leads to 'z'", 15),
        ("nodes:", "nodules:", "has no nodes", 3),
        ("pos: [0.0, 0.0]}", "pos: [0.0, 0.0]", "no YAML", 6),
        ("  - [a, b]\n", "  x: 3\n", "no YAML", 15),
    ],
)
def test_mistakes_have_a_place(write, old, new, message, line):
    file = write(FILE.replace(old, new))
    with pytest.raises(ConfigError, match=message) as raised:
        load_navgraph(file)
    assert raised.value.file == str(file)
    assert raised.value.line is not None
    assert abs(raised.value.line - line) <= 1


@pytest.mark.parametrize(
    "text", ["", "- 1", "nodes: 3", "nodes: [3]", "nodes: [{name: [a], pos: [0, 0]}]", "\0"]
)
def test_other_files_are_refused(write, text):
    with pytest.raises(CxbridgeError):
        load_navgraph(write(text))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        load_navgraph(tmp_path / "none.yaml")


@needs_fawkes
def test_fawkes_own_example():
    assert FAWKES_DIR is not None
    graph = load_navgraph(FAWKES_DIR / "cfg" / "navgraph-example.yaml")
    assert names(graph.path("Origin", "M2")) == ["M1", "M2"]


places = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=6, unique=True)


@given(places, st.data())
def test_no_way_is_shorter(positions, data):
    nodes = {f"n{i}": Node(f"n{i}", float(x), float(y)) for i, (x, y) in enumerate(positions)}
    pairs = list(itertools.permutations(nodes, 2))
    edges = data.draw(st.sets(st.sampled_from(pairs), min_size=1))
    graph = NavGraph(nodes, {name: tuple(b for a, b in sorted(edges) if a == name) for name in nodes})

    def length(way):
        return sum(one.distance(other) for one, other in itertools.pairwise(way))

    others = [name for name in nodes if name not in ("n0", "n1")]
    ways = [
        ("n0", *middle, "n1")
        for count in range(len(others) + 1)
        for middle in itertools.permutations(others, count)
    ]
    possible = [way for way in ways if all(pair in edges for pair in itertools.pairwise(way))]
    if not possible:
        with pytest.raises(SkillError, match="no way"):
            graph.path("n0", "n1")
        return
    found = [nodes["n0"], *graph.path("n0", "n1")]
    assert all((one.name, other.name) in edges for one, other in itertools.pairwise(found))
    shortest = min(length([nodes[name] for name in way]) for way in possible)
    assert length(found) == pytest.approx(shortest)
