"""Plans that an executor like PlanSys2's executes, from the prompt."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.clock import RealClock
from cxbridge.errors import Ros2Error
from cxbridge_ros2.actions import AbortedError, ActionServer, Execution, ServedGoal
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.experts.client import ExpertRefusedError
from cxbridge_ros2.experts.definitions import EXECUTE_PLAN, TYPE_DEFINITIONS
from cxbridge_ros2.experts.execution import parse_item, read_plan
from cxbridge_ros2.experts.nodes import NodeCodec
from cxbridge_ros2.experts.terminal import Terminal, UsageError
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.experts.agents import asking

PLAN = "0.000: (move r2 hall dock) [5.000]\n; then\n5.001: (fill crate1)\n"


def info(action: str, status: int, message: str = "") -> dict[str, Any]:
    name, *arguments = action.strip("()").split()
    return {
        "status": status,
        "action_full_name": f"{action}:0",
        "action": name,
        "arguments": arguments,
        "message_status": message,
    }


def execute_plan(goal: ServedGoal) -> Execution:
    """Execute actions one after the other; those of the name ``break`` fail."""
    actions = [each["action"] for each in goal.goal["plan"]["items"]]
    for action in actions:
        yield {"action_execution_status": [info(action, 2)]}
        if action.startswith("(break"):
            failed = {"success": False, "action_execution_status": [info(action, 3, "it is broken")]}
            raise AbortedError(failed)
    while "(wait)" in actions and not goal.is_cancel_requested:
        yield None
    return {"success": True, "action_execution_status": [info(each, 4) for each in actions]}


@contextmanager
def an_executor(domain: int) -> Iterator[list[ServedGoal]]:
    """Serve plans in a thread; the goals that have come."""
    goals: list[ServedGoal] = []
    over = threading.Event()

    def served(goal: ServedGoal) -> Execution:
        goals.append(goal)
        return execute_plan(goal)

    def serve() -> None:
        with DdsNode("executor", Definitions(environment={}, texts=TYPE_DEFINITIONS), domain) as node:
            server = ActionServer(node, "/execute_plan", EXECUTE_PLAN, served, RealClock())
            while not over.is_set():
                node.poll(0.02)
                server.step()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield goals
    finally:
        over.set()
        thread.join()


@pytest.fixture
def terminal(domain: int) -> Iterator[Terminal]:
    with asking(domain + 11) as client:
        yield Terminal(client, NodeCodec("jazzy"))


def test_a_plan_in_a_file_is_executed(terminal: Terminal, domain: int, tmp_path: Path):
    (tmp_path / "plan").write_text(PLAN)
    with an_executor(domain + 11) as goals:
        said = list(terminal.run_line(f"run plan-file {tmp_path / 'plan'}"))
    assert said[-3:] == [
        "(move r2 hall dock): succeeded",
        "(fill crate1): succeeded",
        "the plan has succeeded",
    ]
    assert [each["action"] for each in goals[0].goal["plan"]["items"]] == [
        "(move r2 hall dock)",
        "(fill crate1)",
    ]
    assert goals[0].goal["plan"]["items"][0]["duration"] == 5


@pytest.mark.parametrize("words", ["(break it)", "break it"])
def test_an_action_that_fails_is_named(terminal: Terminal, domain: int, words: str):
    with an_executor(domain + 11), pytest.raises(ExpertRefusedError, match=r"\(break it\) it is broken"):
        list(terminal.run_line(f"run action {words}"))


def test_who_stops_listening_cancels_the_plan(terminal: Terminal, domain: int):
    with an_executor(domain + 11) as goals:
        steps = terminal.run_line("run action wait")
        assert next(iter(steps)) == "(wait): executing"
        steps.close()  # type: ignore[attr-defined]
        assert goals[0].is_cancel_requested


def test_without_an_executor_it_says_so(terminal: Terminal, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("cxbridge_ros2.experts.execution.DEFAULT_SERVER_TIMEOUT_S", 0.3)
    with pytest.raises(Ros2Error, match="/execute_plan has no server"):
        list(terminal.run_line("run action wait"))


@pytest.mark.parametrize(
    "words", ["run it", "run num_actions", "run num_actions x", "run action", "run plan-file"]
)
def test_wrong_words(terminal: Terminal, words: str):
    with pytest.raises(UsageError, match=f"unknown command '{words}'"):
        list(terminal.run_line(words))


@pytest.mark.parametrize(
    ("text", "problem"),
    [("0: (a\n", r"'0: \(a' is not an action"), (None, "cannot read")],
    ids=["line", "file"],
)
def test_a_plan_that_is_none(tmp_path: Path, text: str | None, problem: str):
    file = tmp_path / "plan"
    if text is not None:
        file.write_text(f"\n{text}")
    with pytest.raises(Ros2Error, match=problem) as caught:
        read_plan(file)
    assert text is None or caught.value.line == 2
    assert os.fspath(file) in str(caught.value)


def test_lines_of_a_plan():
    assert parse_item("1.5: (a b)  [ 2 ]") == {"time": 1.5, "action": "(a b)", "duration": 2.0}
    assert [parse_item(each) for each in ("", "a", "1: a", "1.2.3: (a)", "1: ((a))", "1: (a) [x]")] == [
        None
    ] * 6
