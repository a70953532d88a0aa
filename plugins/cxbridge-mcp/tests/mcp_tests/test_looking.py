"""An assistant's view of scenarios and recordings; further tools need --allow."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.operations.table import verbs
from cxbridge.rights import Right


def test_all_tools_look(looker):
    tools = looker.tools()
    assert not {"run", "explore"} & tools.keys()
    assert [name for name, tool in tools.items() if not tool.annotations.read_only_hint] == []
    assert [name for name, tool in tools.items() if not tool.description] == []


def test_scenarios_and_recordings(looker):
    scenarios = looker.ask("list_scenarios")
    assert {"test-scenario", "broken"} <= set(scenarios)
    recordings = {each["path"]: each["format"] for each in looker.ask("list_recordings")}
    assert recordings == {"a.mcap": "mcap", "mini.mcap": "mcap"}


def test_the_goal_tree(looker):
    answer = looker.ask("goal_tree", recording="a.mcap")
    assert (answer["status"], answer["goals"]) == (0, 20)
    assert answer["tree"].startswith("RUN-ONE-TESTGOAL-PARENT-gen32 (TESTGOAL-PARENT): RETRACTED COMPLETED\n")


def test_why_a_goal_failed_and_a_rule_did_not_fire(looker):
    failed = looker.ask("why_in_recording", recording="a.mcap", name="ALWAYS-FAIL#1")
    assert "FAILED" in failed.splitlines()[0]
    assert "rule talk-player-fail set gen25 to FAILED" in failed
    silent = looker.ask("why_in_recording", recording="mini.mcap", name="silent")
    assert silent.startswith("rule silent has not fired: condition 1 (goal (class OTHER)) has no match")
    assert "did you mean TALK?" in looker.refusal("why_in_recording", recording="a.mcap", name="TALKK")


def test_two_recordings_are_compared(looker, home):
    answer = looker.ask("compare_recordings", first="a.mcap", second="a.mcap", order="total")
    assert (answer["same"], answer["transitions"], answer["differences"]) == (True, [293, 293], [])
    shortened = home / "b.transitions"
    assert invoke(["trace", "convert", str(home / "a.mcap"), str(shortened), "--to", "transitions"]) == 0
    try:
        shortened.write_text("\n".join(shortened.read_text().splitlines()[:-5]) + "\n")
        answer = looker.ask("compare_recordings", first="a.mcap", second="b.transitions")
    finally:
        shortened.unlink()
    assert not answer["same"]
    assert answer["differences"][0].keys() == {"what", "subject", "first", "second"}


def test_an_agent_is_checked(looker):
    assert looker.ask("check_agent", scenario="test-scenario") == "no findings"
    assert "nowhere.clp" in looker.ask("check_agent", scenario="broken")


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
def test_no_file_elsewhere_is_seen(tool, name, path, looker, home):
    link = home / "link"
    link.symlink_to("/")
    rest = {"why_in_recording": {"name": "x"}, "compare_recordings": {"second": "a.mcap"}}.get(tool, {})
    try:
        said = looker.refusal(tool, **{name: path}, **rest)
    finally:
        link.unlink()
    assert "outside the folders of this server" in said


def test_what_changes_anything_is_refused_before_a_daemon_is_asked(looker):
    changing = [name for name, right in verbs().items() if right is not Right.LOOK]
    assert {"assert", "env-eval", "component-change"} <= set(changing)
    for name in changing:
        said = looker.refusal("ask_daemon", operation=name)
        assert f"the operation {name} is not allowed" in said
        assert f"cxbridge mcp --allow {name}" in said
    assert "there is no operation" in looker.refusal("ask_daemon", operation="asert")


def test_a_daemon_that_is_not_there(looker):
    assert "no blackboard replies" in looker.refusal("daemon_status")
