"""Graphs of skills, from a running Skiller and from skill files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.errors import SkillerError
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.assignments import json_value
from cxbridge_studio.terminal.graphs import fetch_graph, make_graph
from tests.cli.boards import Looping, SharedBoard, silent_bus
from tests.fawkes import fawkes_server
from tests.skiller.rig import SKILLS, write_skills
from tests.support import needs_plugin


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


def settle(board: Any, **wanted: Any) -> None:
    """Wait until the interface shows what is wanted."""
    deadline = Deadline(20)
    with Feed(board, "test") as feed:
        news: InterfaceChange | None = feed.read_state(feed.open("SkillerDebugInterface", "Skiller"))
        while news is not None and {name: json_value(news.values[name]) for name in wanted} != wanted:
            news = feed.wait_for_change(deadline)
    assert news is not None


def test_a_graph_is_fetched_and_the_shown_graph_restored(board: Any):
    assert fetch_graph(board, "Skiller", "fail").startswith("digraph fail {")
    settle(board, graph_fsm="ACTIVE")
    assert fetch_graph(board, "Skiller", "SKILL_DEP").startswith("digraph skill_dep")


@needs_plugin("fawkes")
def test_a_graph_is_fetched_over_fawkes_protocol(board: Any):
    with (
        fawkes_server(board) as server,
        open_blackboard(f"fawkes://127.0.0.1:{server.port}", InterfaceRegistry(), RealClock()) as remote,
    ):
        assert fetch_graph(remote, "Skiller", "fail").startswith("digraph fail {")
        settle(board, graph_fsm="ACTIVE")


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


def test_a_graph_from_skill_files(tmp_path: Path):
    write_skills(tmp_path, SKILLS)
    assert make_graph("count", [tmp_path], space="space").startswith("digraph count {")
    assert make_graph("SKILL_DEP", [tmp_path], space="space").startswith("digraph skill_dep")


@pytest.mark.parametrize(
    ("skill", "message"), [("dance", "there is no skill 'dance'"), ("done", "'done' has no state machine")]
)
def test_a_skill_that_cannot_be_drawn(tmp_path: Path, skill: str, message: str):
    write_skills(tmp_path, SKILLS)
    with pytest.raises(SkillerError, match=message) as caught:
        make_graph(skill, [tmp_path], space="space")
    assert "count, done, fail" in str(caught.value)
