"""Agents with ids work in parallel; an action without an executor is an error."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from cxbridge.events import Level
from cxbridge.history.exchange import Exchange, SkillMessage
from ros2cx_tests.rows import Watched, run
from ros2cx_tests.test_recordings import DATA, options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx


def agents_run(tmp_path: Path, more: str = "", executors: tuple[str, ...] = ()) -> Watched:
    """Run the two agents, with more configuration."""
    overlay = tmp_path / "more.yaml"
    overlay.write_text(more)
    chosen = options("agents", None, executors)
    files = (DATA / "two-agents.yaml", overlay) if more else (DATA / "two-agents.yaml",)
    return run(dataclasses.replace(chosen, config=files, timeout=12.0))


def exchange(watched: Watched) -> list[SkillMessage]:
    return [message for message, _ in Exchange().read(watched.messages)]


def changes(watched: Watched, action: int) -> list[str]:
    """What an action went through."""
    rows = [row.change for row in watched.rows if (row.kind, row.key) == ("plan-action", f"G P {action}")]
    return [change.split()[-2 if change.endswith("exec") else -1] for change in rows]


def test_two_agents_work_side_by_side(tmp_path):
    watched = agents_run(tmp_path)
    messages = exchange(watched)
    for agent in ("robot1", "robot2"):
        kinds = [message.type for message in messages if message.agent_id == agent]
        assert kinds == ["REQUEST", "RESPONSE", "CONFIRM", *["FEEDBACK"] * 4, "FINISH"]
    # the second begins before the first has ended
    assert [m.type for m in messages].index("FINISH") > 2 * len(("REQUEST", "RESPONSE", "CONFIRM"))
    for action in (1, 2):
        states = changes(watched, action)
        assert states[:4] == ["PENDING", "WAITING", "RUNNING", "EXECUTION-SUCCEEDED"]


def test_the_original_drops_the_ids_so_the_second_cancels_the_first(tmp_path):
    watched = agents_run(tmp_path, "ros2cx: {mode: original}\n")
    messages = exchange(watched)
    assert {message.agent_id for message in messages} == {"default"}
    kinds = [message.type for message in messages]
    first = ["REQUEST", "RESPONSE", "CONFIRM", "CANCEL", "FINISH"]
    assert kinds == [*first, "REQUEST", "RESPONSE", "CONFIRM", *["FEEDBACK"] * 4, "FINISH"]
    ends = {changes(watched, action)[-1] for action in (1, 2)}
    assert "WAITING" in ends  # the first is not told of its end, as in the original


DEFAULT_ONLY = ("move=cxbridge_ros2cx.executors:DummyExecutor",)


def test_an_agent_that_nobody_serves_is_one_error_each(tmp_path):
    watched = agents_run(tmp_path, executors=DEFAULT_ONLY)
    for action in (1, 2):
        assert changes(watched, action)[:3] == ["PENDING", "WAITING", "EXECUTION-FAILED"]
    errors = [
        line.text for line in watched.log if line.component == "SkillBoard" and line.level is Level.WARN
    ]
    wanted = {f"move of robot{n} FAILED: the agent robot{n} has no executor" for n in (1, 2)}
    assert len(errors) == len(wanted)
    assert {error.partition(": ")[2] for error in errors} == wanted
    assert exchange(watched) == []


def test_agents_that_are_configured_get_dummies_others_do_not(tmp_path):
    watched = agents_run(tmp_path, "skill-board: {agents: {robot2: {}}}\n")
    assert changes(watched, 1)[-1] in ("FAILED", "EXECUTION-FAILED")
    assert "EXECUTION-SUCCEEDED" in changes(watched, 2)
