"""Runs of two agents with ids."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from cxbridge.events import Level
from cxbridge.history.exchange import ExchangeReader, SkillMessage
from ros2cx_tests.rows import ObservedRun, run
from ros2cx_tests.test_recordings import DATA, make_options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx


def run_agents(tmp_path: Path, settings: str = "", executors: tuple[str, ...] = ()) -> ObservedRun:
    """Run the two agents with additional settings."""
    overlay = tmp_path / "more.yaml"
    overlay.write_text(settings)
    run_options = make_options("agents", None, executors)
    files = (DATA / "two-agents.yaml", overlay) if settings else (DATA / "two-agents.yaml",)
    return run(dataclasses.replace(run_options, config=files, timeout=12.0))


def read_exchange(observed: ObservedRun) -> list[SkillMessage]:
    return [message for message, _ in ExchangeReader().read(observed.messages)]


def find_states(observed: ObservedRun, action: int) -> list[str]:
    """Return the states of an action."""
    rows = [row.change for row in observed.rows if (row.kind, row.key) == ("plan-action", f"G P {action}")]
    return [change.split()[-2 if change.endswith("exec") else -1] for change in rows]


def test_agents_work_in_parallel(tmp_path):
    observed = run_agents(tmp_path)
    messages = read_exchange(observed)
    for agent in ("robot1", "robot2"):
        kinds = [message.type for message in messages if message.agent_id == agent]
        assert kinds == ["REQUEST", "RESPONSE", "CONFIRM", *["FEEDBACK"] * 4, "FINISH"]
    # the second action starts before the end of the first
    assert [m.type for m in messages].index("FINISH") > 2 * len(("REQUEST", "RESPONSE", "CONFIRM"))
    for action in (1, 2):
        states = find_states(observed, action)
        assert states[:4] == ["PENDING", "WAITING", "RUNNING", "EXECUTION-SUCCEEDED"]


def test_original_mode_drops_ids_so_second_action_cancels_first(tmp_path):
    observed = run_agents(tmp_path, "ros2cx: {mode: original}\n")
    messages = read_exchange(observed)
    assert {message.agent_id for message in messages} == {"default"}
    kinds = [message.type for message in messages]
    first = ["REQUEST", "RESPONSE", "CONFIRM", "CANCEL", "FINISH"]
    assert kinds == [*first, "REQUEST", "RESPONSE", "CONFIRM", *["FEEDBACK"] * 4, "FINISH"]
    ends = {find_states(observed, action)[-1] for action in (1, 2)}
    assert "WAITING" in ends  # the original does not report the end of the first action, either


DEFAULT_ONLY = ("move=cxbridge_ros2cx.executors:DummyExecutor",)


def test_agent_without_executor_fails_with_single_warning(tmp_path):
    observed = run_agents(tmp_path, executors=DEFAULT_ONLY)
    for action in (1, 2):
        assert find_states(observed, action)[:3] == ["PENDING", "WAITING", "EXECUTION-FAILED"]
    errors = [
        line.text for line in observed.log if line.component == "SkillBoard" and line.level is Level.WARN
    ]
    expected = {f"move of robot{n} FAILED: the agent robot{n} has no executor" for n in (1, 2)}
    assert len(errors) == len(expected)
    assert {error.partition(": ")[2] for error in errors} == expected
    assert read_exchange(observed) == []


def test_only_configured_agents_get_dummies(tmp_path):
    observed = run_agents(tmp_path, "skill-board: {agents: {robot2: {}}}\n")
    assert find_states(observed, 1)[-1] in ("FAILED", "EXECUTION-FAILED")
    assert "EXECUTION-SUCCEEDED" in find_states(observed, 2)
