"""The tools without --allow: scenarios and recordings."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.operations.table import verbs
from cxbridge.rights import Right


def test_all_tools_are_read_only_and_described(assistant):
    tools = assistant.tools()
    assert not {"run", "explore"} & tools.keys()
    assert [name for name, tool in tools.items() if not tool.annotations.read_only_hint] == []
    assert [name for name, tool in tools.items() if not tool.description] == []


def test_scenarios_and_recordings_are_listed(assistant):
    scenarios = assistant.call_tool("list_scenarios")
    assert {"test-scenario", "broken"} <= set(scenarios)
    recordings = {row["path"]: row["format"] for row in assistant.call_tool("list_recordings")}
    assert recordings == {"a.mcap": "mcap", "mini.mcap": "mcap"}


def test_goal_tree_has_status_and_goals(assistant):
    answer = assistant.call_tool("goal_tree", recording="a.mcap")
    assert (answer["status"], answer["goals"]) == (0, 20)
    assert answer["tree"].startswith("RUN-ONE-TESTGOAL-PARENT-gen32 (TESTGOAL-PARENT): RETRACTED COMPLETED\n")


def test_why_explains_failed_goal_and_silent_rule(assistant):
    failed = assistant.call_tool("why_in_recording", recording="a.mcap", name="ALWAYS-FAIL#1")
    assert "FAILED" in failed.splitlines()[0]
    assert "rule talk-player-fail set gen25 to FAILED" in failed
    silent = assistant.call_tool("why_in_recording", recording="mini.mcap", name="silent")
    assert silent.startswith("rule silent has not fired: condition 1 (goal (class OTHER)) has no match")
    assert "did you mean TALK?" in assistant.get_tool_error(
        "why_in_recording", recording="a.mcap", name="TALKK"
    )


def test_recordings_are_compared(assistant, home):
    answer = assistant.call_tool("compare_recordings", first="a.mcap", second="a.mcap", order="total")
    assert (answer["same"], answer["transitions"], answer["differences"]) == (True, [293, 293], [])
    shortened = home / "b.transitions"
    assert invoke(["trace", "convert", str(home / "a.mcap"), str(shortened), "--to", "transitions"]) == 0
    try:
        shortened.write_text("\n".join(shortened.read_text().splitlines()[:-5]) + "\n")
        answer = assistant.call_tool("compare_recordings", first="a.mcap", second="b.transitions")
    finally:
        shortened.unlink()
    assert not answer["same"]
    assert answer["differences"][0].keys() == {"what", "subject", "first", "second"}


def test_agents_are_checked(assistant):
    assert assistant.call_tool("check_agent", scenario="test-scenario") == "no findings"
    assert "nowhere.clp" in assistant.call_tool("check_agent", scenario="broken")


@pytest.mark.parametrize("path", ["../secret", "/etc/passwd", "link/etc/passwd"])
@pytest.mark.parametrize(
    ("tool", "name"),
    [
        ("goal_tree", "recording"),
        ("why_in_recording", "recording"),
        ("compare_recordings", "first"),
        ("check_agent", "scenario"),
    ],
)
def test_files_outside_folder_are_refused(tool, name, path, assistant, home):
    link = home / "link"
    link.symlink_to("/")
    arguments = {"why_in_recording": {"name": "x"}, "compare_recordings": {"second": "a.mcap"}}.get(tool, {})
    try:
        error = assistant.get_tool_error(tool, **{name: path}, **arguments)
    finally:
        link.unlink()
    assert "outside the folders of this server" in error


def test_changing_operations_are_refused_without_daemon(assistant):
    changing = [name for name, right in verbs().items() if right is not Right.LOOK]
    assert {"assert", "env-eval", "component-change"} <= set(changing)
    for name in changing:
        error = assistant.get_tool_error("ask_daemon", operation=name)
        assert f"the operation {name} is not allowed" in error
        assert f"cxbridge mcp --allow {name}" in error
    assert "there is no operation" in assistant.get_tool_error("ask_daemon", operation="asert")


def test_absent_daemon_is_reported(assistant):
    assert "no blackboard replies" in assistant.get_tool_error("daemon_status")
