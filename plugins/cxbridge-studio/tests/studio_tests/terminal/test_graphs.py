"""Graphs of skills: asked of a running Skiller, drawn from skill files, made pictures of."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.assignments import json_value
from cxbridge.skiller.make import skill_folders
from cxbridge_studio.terminal.graphs import fetch_graph, make_graph, render_graph
from tests.cli.boards import Looping, SharedBoard, silent_bus
from tests.fawkes import fawkes_server
from tests.skiller.rig import SKILLS, write_skills
from tests.support import needs_plugin

needs_dot = pytest.mark.skipif(shutil.which("dot") is None, reason="graphviz is not installed")


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Any]:
    from cxbridge.skiller.make import make_lua_skiller

    write_skills(tmp_path, SKILLS)
    shared = SharedBoard()
    with Looping(
        lambda: make_lua_skiller(shared, RealClock(), silent_bus(), folders=[tmp_path], space="space")
    ):
        settle(shared, graph_colored=True)  # its first loop is over
        yield shared
    assert shared.left_open() == []
    shared.shutdown()


def viewer(board: Any) -> Any:
    return board.open_for_reading("SkillerDebugInterface", "Skiller", owner="test")


def settle(board: Any, **wanted: Any) -> None:
    """Wait until the interface shows what is wanted."""
    deadline = Deadline(20)
    with Feed(board, "test") as feed:
        news: InterfaceChange | None = feed.read_state(feed.open("SkillerDebugInterface", "Skiller"))
        while news is not None and {name: json_value(news.values[name]) for name in wanted} != wanted:
            news = feed.wait_for_change(deadline)
    assert news is not None


def test_a_graph_is_asked_for_and_the_view_of_others_put_back(board: Any):
    graph = fetch_graph(board, "Skiller", "fail", direction="LR", coloured=False)
    assert graph.startswith("digraph fail {")
    assert 'rankdir="LR"' in graph
    assert "#cacaff" not in graph
    settle(board, graph_fsm="ACTIVE", graph_dir="GD_TOP_BOTTOM", graph_colored=True)


@needs_plugin("fawkes")
def test_a_graph_is_asked_for_over_fawkes_protocol(board: Any):
    with (
        fawkes_server(board) as server,
        open_blackboard(f"fawkes://127.0.0.1:{server.port}", InterfaceRegistry(), RealClock()) as remote,
    ):
        graph = fetch_graph(remote, "Skiller", "fail", direction="BT", coloured=False)
        assert graph.startswith("digraph fail {")
        assert 'rankdir="BT"' in graph
        settle(board, graph_fsm="ACTIVE", graph_dir="GD_TOP_BOTTOM", graph_colored=True)


@pytest.mark.parametrize(("what", "start"), [("LIST", "count\n"), ("SKILL_DEP", "digraph skill_dep")])
def test_overviews(board: Any, what: str, start: str):
    assert fetch_graph(board, "Skiller", what, direction="LR").startswith(start)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("dance", "no graph of 'dance'"),
        ("done", "no graph of 'done'"),
        ("x" * 40, "longer than the 31 bytes"),
    ],
)
def test_what_the_skiller_cannot_show(board: Any, what: str, message: str):
    with pytest.raises(SkillerError, match=message):
        fetch_graph(board, "Skiller", what)


def test_nobody_there(board: Any):
    with pytest.raises(SkillerError, match="no Skiller writes SkillerDebugInterface::Other"):
        fetch_graph(board, "Other", "count")


def test_a_graph_from_skill_files(tmp_path: Path):
    write_skills(tmp_path, SKILLS)
    graph = make_graph("count", [tmp_path], space="space", direction="RL", coloured=False)
    assert graph.startswith('digraph count {\n\tgraph  [penwidth="2.0", rankdir="RL"];\n')
    assert make_graph("LIST", [tmp_path], space="space") == "count\nfail\ndone\n"


@pytest.mark.parametrize(
    ("skill", "message"), [("dance", "there is no skill 'dance'"), ("done", "'done' has no state machine")]
)
def test_a_skill_that_cannot_be_drawn(tmp_path: Path, skill: str, message: str):
    write_skills(tmp_path, SKILLS)
    with pytest.raises(SkillerError, match=message) as caught:
        make_graph(skill, [tmp_path], space="space")
    assert "count, done, fail" in str(caught.value)


@needs_dot
@pytest.mark.parametrize(("suffix", "start"), [(".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_pictures(suffix: str, start: bytes):
    assert render_graph(make_graph("say", skill_folders()), suffix).startswith(start)


@needs_dot
def test_graphviz_says_what_it_cannot_draw():
    with pytest.raises(CxbridgeError, match="graphviz cannot draw this graph"):
        render_graph("digraph {", ".svg")


def test_without_graphviz_it_is_told_how_to_get_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    with pytest.raises(CxbridgeError, match="graphviz is not installed") as caught:
        render_graph("digraph {}", ".svg")
    assert "apt install graphviz" in str(caught.value)
