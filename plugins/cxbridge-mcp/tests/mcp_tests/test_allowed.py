"""The tools that need --allow: programs, and operations of a daemon within its rights."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from mcp_tests.conftest import assisting
from tests.daemon.test_daemon import running, until
from tests.run.mini import write_scenario

WAITING = "(defrule waits (executive-initialized) (not (goal)) => (assert (goal (id G) (class MINI))))"
"""An agent whose only goal never changes."""


@pytest.fixture
def endpoint():
    """An address whose path leaves room for a socket's name."""
    with tempfile.TemporaryDirectory(prefix="cx") as folder:
        yield f"ipc://{folder}/bb"


def test_a_run_that_is_allowed_is_recorded(tmp_path):
    write_scenario(tmp_path / "mini")
    with assisting(tmp_path, "--allow", "run") as assistant:
        tools = assistant.tools()
        assert "explore" not in tools
        annotations = tools["run"].annotations
        assert annotations is not None
        assert annotations.destructive_hint
        assert "G (MINI): COMPLETED" in assistant.ask("run", scenario="mini", recording="new.mcap")
        assert assistant.ask("goal_tree", recording="new.mcap")["tree"].startswith("G (MINI): ")
        again = assistant.refusal("run", scenario="mini", recording="new.mcap")
        assert "'new.mcap' exists already" in again
        assert "ends in .mcap" in assistant.refusal("run", scenario="mini", recording="mini/mini.clp")
        assert "outside" in assistant.refusal("run", scenario="mini", recording="../new.mcap")
        slow = assistant.refusal("run", scenario="mini", recording="slow.mcap", patience=0.01)
        assert "'cxbridge run' has not ended after 0.01 s" in slow
        broken = write_scenario(tmp_path / "broken", agent="(defrule r (nothing-that-there-is) => (gone))")
        assert "the agent was not started" in assistant.refusal(
            "run", scenario=broken.name, recording="c.mcap"
        )


def test_exploring_names_the_package_that_it_needs_or_explores(tmp_path):
    write_scenario(tmp_path / "mini")
    with assisting(tmp_path, "--allow", "explore") as assistant:
        try:
            import cxbridge_explore  # noqa: F401
        except ImportError:
            assert "cxbridge-explore" in assistant.refusal("explore", scenario="mini", faults=0)
        else:
            assert "1 run," in assistant.ask("explore", scenario="mini", faults=0)


def test_a_daemon_is_looked_at(tmp_path, endpoint):
    scenario = write_scenario(tmp_path / "mini", agent=WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [endpoint]))
    with (
        running(config=scenario, settings=settings),
        assisting(tmp_path, "--connect", endpoint, "--allow", "assert") as assistant,
    ):
        assert assistant.ask("daemon_status")["state"] == "RUNNING"
        (skiller,) = assistant.ask("list_interfaces", pattern="SkillerInterface")
        assert skiller["interface"] == "SkillerInterface::Skiller"
        assert "status" in assistant.ask("read_interface", interface="SkillerInterface::Skiller")
        assert "there is no interface" in assistant.refusal("read_interface", interface="SkillerInterface::X")
        assert until(lambda: "(goal (id G)" in str(assistant.ask("list_facts", template="goal")))
        assert "MINI" in assistant.ask("why_in_daemon", name="G")
        assert "executive" in assistant.ask("ask_daemon", operation="env-list")
        arguments = {"env": "executive", "fact": "(said-by assistant)"}
        assistant.ask("ask_daemon", operation="assert", arguments=arguments)
        assert "(said-by assistant)" in str(assistant.ask("list_facts", template="said-by"))
        assert "not allowed" in assistant.refusal("ask_daemon", operation="retract")


def test_the_rights_of_the_daemon_count_more_than_allow(tmp_path, endpoint):
    scenario = write_scenario(tmp_path / "mini", agent=WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [endpoint]), ("remote-control", False))
    with (
        running(config=scenario, settings=settings),
        assisting(tmp_path, "--connect", endpoint, "--allow", "assert") as assistant,
    ):
        arguments = {"env": "executive", "fact": "(x)"}
        said = assistant.refusal("ask_daemon", operation="assert", arguments=arguments)
        assert "cxbridge/remote-control of the daemon is off" in said
        assert until(lambda: "(goal (id G)" in str(assistant.ask("list_facts", template="goal")))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--allow", "exlore"], "did you mean explore?"),
        (["--allow", "env-evl"], "did you mean env-eval?"),
        (["nowhere"], "there is no such folder"),
    ],
)
def test_what_there_is_not_is_refused_at_the_start(arguments, said, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert invoke(["mcp", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert list(Path().iterdir()) == []
