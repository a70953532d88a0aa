"""A daemon as a managed node: its log, lifecycle and parameters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.daemon.client import send_command
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.events import LogLine
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, DEACTIVATE, SHUTDOWN, LifecycleState
from cxbridge_ros2.node import Node
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.clients import LifecycleClient, ParameterClient, subscribe_log
from ros2_tests.conftest import poll_until
from ros2_tests.experts.agents import FAST
from ros2_tests.test_managed import wait_for_answer
from tests.daemon.test_daemon import running

QUIET = "cxbridge: {fawkes: {enable: false}, zmq: {endpoints: []}}\n"


@contextmanager
def run_daemon(folder: Path, domain: int, settings: str = "") -> Iterator[Daemon]:
    file = folder / "daemon.yaml"
    file.write_text(f"{QUIET}{FAST}ros2: {{node: {{name: robot, domain: {domain + 2}{settings}}}}}\n")
    with running(DaemonOptions(config=file)) as (daemon, _lines, _outcome):
        yield daemon


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    with DdsNode("asks", Definitions(environment={}), domain + 2) as node:
        yield node


@pytest.fixture
def daemon(domain: int, tmp_path: Path) -> Iterator[Daemon]:
    with run_daemon(tmp_path, domain) as daemon:
        yield daemon


@pytest.fixture
def client(node: Node, daemon: Daemon) -> LifecycleClient:
    client = LifecycleClient(node, "/robot")
    poll_until(node, lambda: client.has_server)
    return client


def test_transitions_pause_and_resume_daemon(node: Node, daemon: Daemon, client: LifecycleClient):
    def change(name: str) -> Any:
        return wait_for_answer(node, lambda done: client.change(name, done))

    assert wait_for_answer(node, client.state) is LifecycleState.ACTIVE
    assert change(DEACTIVATE) is True
    assert (daemon.state, wait_for_answer(node, client.state)) == ("PAUSED", LifecycleState.INACTIVE)
    assert change(CLEANUP) is False
    assert change(ACTIVATE) is True
    assert (daemon.state, wait_for_answer(node, client.state)) == ("RUNNING", LifecycleState.ACTIVE)


def test_pause_over_blackboard_is_published_as_transition(
    node: Node, daemon: Daemon, client: LifecycleClient
):
    states: list[str] = []
    topic, kind = "/robot/transition_event", "lifecycle_msgs/msg/TransitionEvent"
    node.subscribe(topic, kind, lambda each: states.append(each["goal_state"]["label"]))
    poll_until(node, lambda: not node.poll(0.5))
    assert send_command(daemon.board, "Pause", 10)
    poll_until(node, lambda: "inactive" in states)
    assert wait_for_answer(node, client.state) is LifecycleState.INACTIVE


def test_diagnostics_have_components_of_daemon(node: Node, daemon: Daemon):
    got: list[Any] = []
    node.subscribe("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", got.append)
    poll_until(node, lambda: got)
    status_by_name = {each["name"]: (each["level"], each["message"]) for each in got[-1]["status"]}
    assert status_by_name["robot: ros2-node"] == (0, "active")
    assert {f"robot: {each.name}" for each in daemon.lifecycle.status()} == {*status_by_name}


def test_shutdown_transition_ends_daemon(node: Node, daemon: Daemon, client: LifecycleClient):
    client.change(SHUTDOWN, lambda _done: None)
    # if the last response is lost, DDS drops the node after ten seconds
    poll_until(node, lambda: daemon.state == "FINALIZED" or not client.has_server)


def test_daemon_publishes_log_and_read_only_parameters(node: Node, domain: int, tmp_path: Path):
    with run_daemon(tmp_path, domain, ", log: debug"):
        lines: list[LogLine] = []
        subscribe_log(node, lines.append)
        poll_until(node, lambda: lines)
        assert {line.component.partition(".")[0] for line in lines} == {"robot"}
        parameters = ParameterClient(node, "/robot")
        poll_until(node, lambda: parameters.has_server)
        assert wait_for_answer(node, lambda done: parameters.get(["use_sim_time"], done)) == {
            "use_sim_time": False
        }
        (reason,) = wait_for_answer(node, lambda done: parameters.set({"spec": "other"}, done)).values()
        assert reason == "the parameters of this node are read-only"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (", lgo: info", "has no setting 'lgo'"),
        (", log: loud", "unknown log level 'loud'"),
        (", name: a-b", "'a-b' is not a valid node name"),
    ],
)
def test_invalid_settings_are_refused(domain: int, tmp_path: Path, settings: str, message: str):
    file = tmp_path / "daemon.yaml"
    text = f"{QUIET}ros2: {{node: {{domain: {domain + 2}{settings}}}}}\n"
    file.write_text(text)
    with pytest.raises(CxbridgeError, match=message) as caught:
        Daemon(DaemonOptions(config=file), lambda line: None).run()
    assert caught.value.line == 2
