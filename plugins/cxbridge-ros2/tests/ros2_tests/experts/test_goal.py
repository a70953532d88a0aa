"""Goals of clients, which the rules of the manual pursue, and the settings of the experts."""

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
from ros2_tests.conftest import wait_until
from ros2_tests.experts.agents import HERE, MEETING, join_client, run_agent, write_configuration
from ros2_tests.experts.test_services import SERVICE_NAMES, make_goal, make_instance, make_predicate
from tests.support import ROOT, needs_plugin

RULES = (HERE / "wanted.clp").read_text()


def copy_meeting_with_rules(folder: Path) -> Path:
    """Copy the scenario, and replace its goal by the rules of the manual."""
    agent = folder / "agent"
    shutil.copytree(MEETING, agent)
    (agent / "meet-goals.clp").write_text(RULES)
    return agent


def test_manual_has_rules_of_test():
    assert RULES in (ROOT / "docs" / "ros2.md").read_text()


def test_agent_pursues_goal_of_client(domain: int, tmp_path: Path):
    with run_agent(tmp_path, domain, copy_meeting_with_rules(tmp_path)), join_client(domain) as client:
        client.request(SERVICE_NAMES["add_problem_instance"], make_instance("R2", "name"))
        request = make_goal("(said R2 GOODBYE)")
        client.request(SERVICE_NAMES["add_problem_goal"], request)
        wait = partial(client.wait, lambda: False, 0.2)
        wait_until(
            lambda: client.request(SERVICE_NAMES["is_problem_goal_satisfied"], request)["satisfied"], wait
        )
        wait_until(lambda: not client.request(SERVICE_NAMES["get_problem_goal"])["tree"]["nodes"], wait)
        response = client.call(
            SERVICE_NAMES["exist_problem_predicate"], make_predicate("said", "R2", "HELLO")
        )
        assert response["exist"] is True


def test_paused_and_reset_daemon_answers_requests(domain: int, tmp_path: Path):
    with run_agent(tmp_path, domain) as daemon, join_client(domain) as client:
        client.request(SERVICE_NAMES["add_problem_instance"], make_instance("attic", "room"))
        assert send_command(daemon.board, "Pause", 10)
        client.wait(lambda: daemon.state == "PAUSED", 10)
        assert "attic" in client.request(SERVICE_NAMES["get_problem"])["problem"]
        assert send_command(daemon.board, "Reset", 10)
        client.wait(lambda: "attic" not in client.call(SERVICE_NAMES["get_problem"])["problem"], 10)
        assert send_command(daemon.board, "Resume", 10)
        client.wait(lambda: daemon.state == "RUNNING", 10)
        assert "(at r2 hall)" in client.request(SERVICE_NAMES["get_problem"])["problem"]


def test_domain_expert_is_served_without_problem_expert(domain: int, tmp_path: Path):
    with run_agent(tmp_path, domain, experts=", serve: [domain]"), join_client(domain) as client:
        assert client.request(SERVICE_NAMES["get_domain_name"])["name"] == "tour"
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
def test_invalid_settings_are_refused(tmp_path: Path, settings: str, message: str):
    with pytest.raises(CxbridgeError, match=message) as caught:
        Daemon(
            DaemonOptions(config=write_configuration(tmp_path, HERE / "agent", settings)), lambda line: None
        ).run()
    assert caught.value.line


@needs_plugin("studio")
@pytest.mark.parametrize("is_served", [True, False])
def test_check_accepts_facts_of_clients(tmp_path: Path, is_served: bool):
    from cxbridge_studio.check.run import check

    agent = copy_meeting_with_rules(tmp_path)
    if is_served:
        with (agent / "scenario.yaml").open("a") as file:
            file.write("ros2: {experts: {serve: all}}\n")
    messages = [each.message for each in check(RunOptions(scenario=agent))]
    assert [each for each in messages if "problem-goal" not in each] == []
    assert (messages == []) is is_served
