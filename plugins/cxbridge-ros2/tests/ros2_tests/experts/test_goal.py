"""A goal that a client sets is a fact, and the rules of the page pursue it; rights; settings."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.daemon.client import send_command
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.run import RunOptions
from cxbridge_ros2.experts.definitions import SERVICES_BY_NODE
from ros2_tests.conftest import until
from ros2_tests.experts.agents import HERE, MEETING, asking, configuration, served
from ros2_tests.experts.test_services import WHOLE, goal, named, predicate
from tests.support import ROOT, needs_plugin

WANTED = (HERE / "wanted.clp").read_text()


def meeting_that_listens(folder: Path) -> Path:
    """Copy the scenario, with the rules of the page in place of its goal."""
    agent = folder / "agent"
    shutil.copytree(MEETING, agent)
    (agent / "meet-goals.clp").write_text(WANTED)
    return agent


def test_the_page_has_the_rules():
    assert WANTED in (ROOT / "docs" / "ros2.md").read_text()


def test_a_goal_is_pursued(domain: int, tmp_path: Path):
    with served(tmp_path, domain, meeting_that_listens(tmp_path)), asking(domain) as client:
        client.request(WHOLE["add_problem_instance"], named("R2", "name"))
        wanted = goal("(said R2 GOODBYE)")
        client.request(WHOLE["add_problem_goal"], wanted)
        wait = partial(client.wait, lambda: False, 0.2)
        until(lambda: client.request(WHOLE["is_problem_goal_satisfied"], wanted)["satisfied"], wait)
        until(lambda: not client.request(WHOLE["get_problem_goal"])["tree"]["nodes"], wait)
        found = client.call(WHOLE["exist_problem_predicate"], predicate("said", "R2", "HELLO"))
        assert found["exist"] is True


def test_while_it_is_paused_and_after_a_reset(domain: int, tmp_path: Path):
    with served(tmp_path, domain) as daemon, asking(domain) as client:
        client.request(WHOLE["add_problem_instance"], named("attic", "room"))
        assert send_command(daemon.board, "Pause", 10)
        client.wait(lambda: daemon.state == "PAUSED", 10)
        assert "attic" in client.request(WHOLE["get_problem"])["problem"]
        assert send_command(daemon.board, "Reset", 10)
        client.wait(lambda: "attic" not in client.call(WHOLE["get_problem"])["problem"], 10)
        assert send_command(daemon.board, "Resume", 10)
        client.wait(lambda: daemon.state == "RUNNING", 10)
        assert "(at r2 hall)" in client.request(WHOLE["get_problem"])["problem"]


def test_a_part_of_it_is_served(domain: int, tmp_path: Path):
    with served(tmp_path, domain, experts=", serve: [domain]"), asking(domain) as client:
        assert client.request(WHOLE["get_domain_name"])["name"] == "tour"
        clients = [
            client.node.create_client(name, f"plansys2_msgs/srv/{kind}")
            for name, kind in SERVICES_BY_NODE["problem"].items()
        ]
        client.wait(lambda: False, 1)
        assert not any(each.has_server for each in clients)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("{serve: all, sevre: all}", "has no setting 'sevre'"),
        ("{serve: executor}", "'executor' is not a service of the experts"),
        ("{serve: all, transport: pigeon}", "there is no transport 'pigeon'"),
    ],
)
def test_mistakes(tmp_path: Path, settings: str, message: str):
    with pytest.raises(CxbridgeError, match=message) as caught:
        Daemon(
            DaemonOptions(config=configuration(tmp_path, HERE / "agent", settings)), lambda line: None
        ).run()
    assert caught.value.line


@needs_plugin("studio")
@pytest.mark.parametrize("served_", [True, False])
def test_the_check_knows_the_facts_of_clients(tmp_path: Path, served_: bool):
    from cxbridge_studio.check.run import check

    agent = meeting_that_listens(tmp_path)
    if served_:
        with (agent / "scenario.yaml").open("a") as file:
            file.write("ros2: {experts: {serve: all}}\n")
    found = [each.message for each in check(RunOptions(scenario=agent))]
    assert [each for each in found if "problem-goal" not in each] == []
    assert (found == []) is served_
