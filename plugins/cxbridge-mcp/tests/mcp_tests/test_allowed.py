"""The tools that need --allow: runs, explorations, and operations of a daemon."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from mcp_tests.conftest import start_assistant
from tests.daemon.test_daemon import running, until
from tests.run.mini import write_scenario

WAITING = "(defrule waits (executive-initialized) (not (goal)) => (assert (goal (id G) (class MINI))))"
"""An agent whose only goal never changes."""


@pytest.fixture
def endpoint():
    """A short address, because paths of sockets have a maximum length."""
    with tempfile.TemporaryDirectory(prefix="cx") as folder:
        yield f"ipc://{folder}/bb"


def test_allowed_run_is_recorded(tmp_path):
    write_scenario(tmp_path / "mini")
    with start_assistant(tmp_path, "--allow", "run") as assistant:
        tools = assistant.tools()
        assert "explore" not in tools
        annotations = tools["run"].annotations
        assert annotations is not None
        assert annotations.destructive_hint
        assert "G (MINI): COMPLETED" in assistant.call_tool("run", scenario="mini", recording="new.mcap")
        assert assistant.call_tool("goal_tree", recording="new.mcap")["tree"].startswith("G (MINI): ")
        existing_error = assistant.get_tool_error("run", scenario="mini", recording="new.mcap")
        assert "'new.mcap' exists already" in existing_error
        assert "ends in .mcap" in assistant.get_tool_error("run", scenario="mini", recording="mini/mini.clp")
        assert "outside" in assistant.get_tool_error("run", scenario="mini", recording="../new.mcap")
        timeout_error = assistant.get_tool_error("run", scenario="mini", recording="slow.mcap", patience=0.01)
        assert "'cxbridge run' has not ended after 0.01 s" in timeout_error
        broken = write_scenario(tmp_path / "broken", agent="(defrule r (nothing-that-there-is) => (gone))")
        assert "the agent was not started" in assistant.get_tool_error(
            "run", scenario=broken.name, recording="c.mcap"
        )


def test_explore_tool_explores_or_names_missing_package(tmp_path):
    write_scenario(tmp_path / "mini")
    with start_assistant(tmp_path, "--allow", "explore") as assistant:
        try:
            import cxbridge_explore  # noqa: F401
        except ImportError:
            assert "cxbridge-explore" in assistant.get_tool_error("explore", scenario="mini", faults=0)
        else:
            assert "1 run," in assistant.call_tool("explore", scenario="mini", faults=0)


def test_tools_read_and_edit_daemon(tmp_path, endpoint):
    scenario = write_scenario(tmp_path / "mini", agent=WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [endpoint]))
    with (
        running(config=scenario, settings=settings),
        start_assistant(tmp_path, "--connect", endpoint, "--allow", "assert") as assistant,
    ):
        assert assistant.call_tool("daemon_status")["state"] == "RUNNING"
        (skiller,) = assistant.call_tool("list_interfaces", pattern="SkillerInterface")
        assert skiller["interface"] == "SkillerInterface::Skiller"
        assert "status" in assistant.call_tool("read_interface", interface="SkillerInterface::Skiller")
        assert "there is no interface" in assistant.get_tool_error(
            "read_interface", interface="SkillerInterface::X"
        )
        assert until(lambda: "(goal (id G)" in str(assistant.call_tool("list_facts", template="goal")))
        assert "MINI" in assistant.call_tool("why_in_daemon", name="G")
        assert "executive" in assistant.call_tool("ask_daemon", operation="env-list")
        arguments = {"env": "executive", "fact": "(said-by assistant)"}
        assistant.call_tool("ask_daemon", operation="assert", arguments=arguments)
        assert "(said-by assistant)" in str(assistant.call_tool("list_facts", template="said-by"))
        assert "not allowed" in assistant.get_tool_error("ask_daemon", operation="retract")


def test_rights_of_daemon_limit_allow_option(tmp_path, endpoint):
    scenario = write_scenario(tmp_path / "mini", agent=WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [endpoint]), ("remote-control", False))
    with (
        running(config=scenario, settings=settings),
        start_assistant(tmp_path, "--connect", endpoint, "--allow", "assert") as assistant,
    ):
        arguments = {"env": "executive", "fact": "(x)"}
        error = assistant.get_tool_error("ask_daemon", operation="assert", arguments=arguments)
        assert "cxbridge/remote-control of the daemon is off" in error
        assert until(lambda: "(goal (id G)" in str(assistant.call_tool("list_facts", template="goal")))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--allow", "exlore"], "did you mean explore?"),
        (["--allow", "env-evl"], "did you mean env-eval?"),
        (["nowhere"], "there is no such folder"),
    ],
)
def test_unknown_operation_and_folder_are_refused_at_start(arguments, message, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert invoke(["mcp", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert list(Path().iterdir()) == []
