"""Incompatible nodes: different types, definitions, quality of service or ranges of discovery."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import poll_until
from tests.support import ROOT

LATCHED = QosProfile(durability="transient_local")
LOSSY = QosProfile(reliability="best_effort")

Join = Callable[..., tuple[DdsNode, list[str]]]


@pytest.fixture
def join(domain: int) -> Iterator[Join]:
    """Return a function that makes a node with a list of its reports."""
    numbers = count()
    with ExitStack() as nodes:

        def add_node(*folders: Path) -> tuple[DdsNode, list[str]]:
            reports: list[str] = []
            name = f"node{next(numbers)}"
            node = DdsNode(
                name, Definitions(folders, environment={}), domain + 12, "localhost", reports.append
            )
            return nodes.enter_context(node), reports

        yield add_node


def write_package(folder: Path, fields: str) -> Path:
    subfolder = folder / "demo_msgs/msg"
    subfolder.mkdir(parents=True)
    (subfolder / "Reading.msg").write_text(fields)
    return folder


def test_different_type_on_topic_is_reported(join: Join):
    (ours, our_reports), (theirs, their_reports) = join(), join()
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None)
    theirs.create_publisher("/chatter", "std_msgs/msg/Int32")
    poll_until(ours, lambda: our_reports)
    poll_until(theirs, lambda: their_reports)
    assert our_reports == [
        "/chatter: another node's publisher has the type std_msgs/msg/Int32, ours has std_msgs/msg/String"
    ]
    assert their_reports == [
        "/chatter: another node's subscription has the type std_msgs/msg/String, ours has std_msgs/msg/Int32"
    ]


def test_different_type_of_earlier_publisher_is_reported(join: Join):
    (ours, our_reports), (theirs, _) = join(), join()
    theirs.create_publisher("/chatter", "std_msgs/msg/Int32")
    poll_until(ours, lambda: any(ours._discovery._discovered_endpoints.values()))
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None)
    assert [each.partition(":")[0] for each in our_reports] == ["/chatter"]


def test_different_definition_of_type_is_reported(join: Join, tmp_path: Path):
    ours, our_reports = join(write_package(tmp_path / "new", "float64 value\nstring unit\n"))
    theirs, _ = join(write_package(tmp_path / "old", "float32 value\nstring unit\n"))
    ours.subscribe("/reading", "demo_msgs/msg/Reading", lambda _message: None)
    theirs.create_publisher("/reading", "demo_msgs/msg/Reading")
    poll_until(ours, lambda: our_reports)
    (text,) = our_reports
    assert text.startswith(
        "/reading: the definition of demo_msgs/msg/Reading at another node's publisher differs"
    )
    assert len(set(re.findall("RIHS01_[0-9a-f]{64}", text))) == 2
    assert text.endswith("name the folder of its package in 'packages'")


@pytest.mark.parametrize(
    ("offered", "requested", "policy"),
    [(LOSSY, QosProfile(), "RELIABILITY"), (QosProfile(), LATCHED, "DURABILITY")],
)
def test_incompatible_quality_of_service_is_reported(
    join: Join, offered: QosProfile, requested: QosProfile, policy: str
):
    (ours, our_reports), (theirs, their_reports) = join(), join()
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None, requested)
    theirs.create_publisher("/chatter", "std_msgs/msg/String", offered)
    poll_until(ours, lambda: our_reports)
    poll_until(theirs, lambda: their_reports)
    end = f"so no messages arrive; see its QoS policy {policy}"
    assert our_reports == [f"/chatter: another node's publisher offers less than ours requests, {end}"]
    assert their_reports == [f"/chatter: another node's subscription requests more than ours offers, {end}"]


def test_compatible_endpoints_report_nothing(join: Join):
    (ours, our_reports), (theirs, their_reports) = join(), join()
    got: list[Any] = []
    ours.subscribe("/chatter", "std_msgs/msg/String", got.append, LOSSY)
    ours.serve("/empty", "std_srvs/srv/Empty", lambda _request: {})
    publisher = theirs.create_publisher("/chatter", "std_msgs/msg/String", LATCHED)
    client = theirs.create_client("/empty", "std_srvs/srv/Empty")
    poll_until(ours, lambda: publisher.count_subscriptions() and client.has_server)
    for node in (ours, theirs):
        node._discovery.update()
    assert our_reports + their_reports == []


def test_missing_server_is_explained(join: Join, domain: int):
    ours, _ = join()
    client = ours.create_client("/beep", "std_srvs/srv/Trigger")
    scope = f"the domain {domain + 12} on this host (reach: subnet includes further hosts)"
    assert client.explain_missing_server() == f"there is no other node in {scope}"
    theirs, _ = join()
    end = theirs.serve("/beeep", "std_srvs/srv/Trigger", lambda _request: {})
    poll_until(ours, client.explain_missing_server)
    poll_until(ours, lambda: client.explain_missing_server() == "did you mean /beeep?")
    end()
    theirs.serve("/beep", "std_srvs/srv/SetBool", lambda _request: {})
    poll_until(ours, lambda: client.explain_missing_server() == "it is served as std_srvs/srv/SetBool")


SUBSCRIBER = """
import sys, time
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.dds import DdsNode

with DdsNode("far", Definitions(environment={}), int(sys.argv[1])) as node:
    messages = []
    node.subscribe("/chatter", "std_msgs/msg/String", messages.append)
    end = time.monotonic() + float(sys.argv[2])
    while not messages and time.monotonic() < end:
        node.poll(0.1)
    print(len(messages))
"""


@pytest.mark.parametrize(("reach", "seconds", "received"), [("off", 3, "0"), ("localhost", 30, "1")])
def test_discovery_range_limits_subscribers(
    domain: int, monkeypatch: pytest.MonkeyPatch, reach: str, seconds: int, received: str
):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", reach.upper())
    with DdsNode("near", Definitions(environment={}), domain + 16) as node:
        publisher = node.create_publisher("/chatter", "std_msgs/msg/String")
        command = [sys.executable, "-c", SUBSCRIBER, str(domain + 16), str(seconds)]
        environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, text=True, cwd=ROOT
        ) as subscriber:
            while subscriber.poll() is None:
                publisher.publish({"data": "x"})
                node.poll(0.05)
            assert subscriber.stdout is not None
            assert subscriber.stdout.read().strip() == received
