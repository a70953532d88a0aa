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
from cxbridge_studio.skill_graphs import fetch_graph, make_graph
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
        wait_for_values(shared, graph_colored=True)  # after the first loop of the Skiller
        yield shared
    assert shared.left_open() == []
    shared.shutdown()


def wait_for_values(board: Any, **expected: Any) -> None:
    """Wait until the fields of the interface have the expected values."""
    deadline = Deadline(20)
    with Feed(board, "test") as feed:
        change: InterfaceChange | None = feed.read_state(feed.open("SkillerDebugInterface", "Skiller"))
        while change is not None and {name: json_value(change.values[name]) for name in expected} != expected:
            change = feed.wait_for_change(deadline)
    assert change is not None


def test_fetch_of_graph_restores_shown_graph(board: Any):
    assert fetch_graph(board, "Skiller", "fail").startswith("digraph fail {")
    wait_for_values(board, graph_fsm="ACTIVE")
    assert fetch_graph(board, "Skiller", "SKILL_DEP").startswith("digraph skill_dep")


@needs_plugin("fawkes")
def test_graph_is_fetched_over_fawkes_protocol(board: Any):
    with (
        fawkes_server(board) as server,
        open_blackboard(f"fawkes://127.0.0.1:{server.port}", InterfaceRegistry(), RealClock()) as remote,
    ):
        assert fetch_graph(remote, "Skiller", "fail").startswith("digraph fail {")
        wait_for_values(board, graph_fsm="ACTIVE")


@pytest.mark.parametrize(
    ("skill", "message"),
    [
        ("dance", "no graph of 'dance'"),
        ("done", "no graph of 'done'"),
        ("x" * 40, "longer than the 31 bytes"),
    ],
)
def test_unknown_graph_is_an_error(board: Any, skill: str, message: str):
    with pytest.raises(SkillerError, match=message):
        fetch_graph(board, "Skiller", skill)


def test_graph_is_made_from_skill_files(tmp_path: Path):
    write_skills(tmp_path, SKILLS)
    assert make_graph("count", [tmp_path], space="space").startswith("digraph count {")
    assert make_graph("SKILL_DEP", [tmp_path], space="space").startswith("digraph skill_dep")


@pytest.mark.parametrize(
    ("skill", "message"), [("dance", "there is no skill 'dance'"), ("done", "'done' has no state machine")]
)
def test_skill_without_graph_is_an_error_with_names(tmp_path: Path, skill: str, message: str):
    write_skills(tmp_path, SKILLS)
    with pytest.raises(SkillerError, match=message) as caught:
        make_graph(skill, [tmp_path], space="space")
    assert "count, done, fail" in str(caught.value)
