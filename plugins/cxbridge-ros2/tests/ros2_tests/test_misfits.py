"""Nodes that do not fit together: other types, other definitions, other quality of service, other places."""

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
    """Make nodes, each with a list of its reports."""
    numbers = count()
    with ExitStack() as nodes:

        def make(*folders: Path) -> tuple[DdsNode, list[str]]:
            said: list[str] = []
            name = f"node{next(numbers)}"
            node = DdsNode(name, Definitions(folders, environment={}), domain + 12, "localhost", said.append)
            return nodes.enter_context(node), said

        yield make


def a_package(folder: Path, fields: str) -> Path:
    place = folder / "demo_msgs/msg"
    place.mkdir(parents=True)
    (place / "Reading.msg").write_text(fields)
    return folder


def test_another_type_on_the_topic(join: Join):
    (ours, said), (theirs, they_said) = join(), join()
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None)
    theirs.create_publisher("/chatter", "std_msgs/msg/Int32")
    poll_until(ours, lambda: said)
    poll_until(theirs, lambda: they_said)
    assert said == [
        "/chatter: another node's publisher has the type std_msgs/msg/Int32, ours has std_msgs/msg/String"
    ]
    assert they_said == [
        "/chatter: another node's subscription has the type std_msgs/msg/String, ours has std_msgs/msg/Int32"
    ]


def test_it_is_found_whoever_was_there_first(join: Join):
    (ours, said), (theirs, _) = join(), join()
    theirs.create_publisher("/chatter", "std_msgs/msg/Int32")
    poll_until(ours, lambda: any(ours._discovery._discovered_endpoints.values()))
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None)
    assert [each.partition(":")[0] for each in said] == ["/chatter"]


def test_another_definition_of_the_type(join: Join, tmp_path: Path):
    ours, said = join(a_package(tmp_path / "new", "float64 value\nstring unit\n"))
    theirs, _ = join(a_package(tmp_path / "old", "float32 value\nstring unit\n"))
    ours.subscribe("/reading", "demo_msgs/msg/Reading", lambda _message: None)
    theirs.create_publisher("/reading", "demo_msgs/msg/Reading")
    poll_until(ours, lambda: said)
    (text,) = said
    assert text.startswith(
        "/reading: the definition of demo_msgs/msg/Reading at another node's publisher differs"
    )
    assert len(set(re.findall("RIHS01_[0-9a-f]{64}", text))) == 2
    assert text.endswith("name the folder of its package in 'packages'")


@pytest.mark.parametrize(
    ("offered", "wanted", "policy"),
    [(LOSSY, QosProfile(), "RELIABILITY"), (QosProfile(), LATCHED, "DURABILITY")],
)
def test_quality_of_service_that_does_not_fit(
    join: Join, offered: QosProfile, wanted: QosProfile, policy: str
):
    (ours, said), (theirs, they_said) = join(), join()
    ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None, wanted)
    theirs.create_publisher("/chatter", "std_msgs/msg/String", offered)
    poll_until(ours, lambda: said)
    poll_until(theirs, lambda: they_said)
    end = f"so no messages arrive; see its QoS policy {policy}"
    assert said == [f"/chatter: another node's publisher offers less than ours requests, {end}"]
    assert they_said == [f"/chatter: another node's subscription requests more than ours offers, {end}"]


def test_those_that_fit_say_nothing(join: Join):
    (ours, said), (theirs, they_said) = join(), join()
    got: list[Any] = []
    ours.subscribe("/chatter", "std_msgs/msg/String", got.append, LOSSY)
    ours.serve("/empty", "std_srvs/srv/Empty", lambda _request: {})
    sends = theirs.create_publisher("/chatter", "std_msgs/msg/String", LATCHED)
    client = theirs.create_client("/empty", "std_srvs/srv/Empty")
    poll_until(ours, lambda: sends.count_subscriptions() and client.has_server)
    for node in (ours, theirs):
        node._discovery.update()
    assert said + they_said == []


def test_why_nobody_serves(join: Join, domain: int):
    ours, _ = join()
    client = ours.create_client("/beep", "std_srvs/srv/Trigger")
    here = f"the domain {domain + 12} on this host (reach: subnet includes further hosts)"
    assert client.explain_missing_server() == f"there is no other node in {here}"
    theirs, _ = join()
    end = theirs.serve("/beeep", "std_srvs/srv/Trigger", lambda _request: {})
    poll_until(ours, client.explain_missing_server)
    poll_until(ours, lambda: client.explain_missing_server() == "did you mean /beeep?")
    end()
    theirs.serve("/beep", "std_srvs/srv/SetBool", lambda _request: {})
    poll_until(ours, lambda: client.explain_missing_server() == "it is served as std_srvs/srv/SetBool")


HEARD = """
import sys, time
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.dds import DdsNode

with DdsNode("far", Definitions(environment={}), int(sys.argv[1])) as node:
    heard = []
    node.subscribe("/chatter", "std_msgs/msg/String", heard.append)
    end = time.monotonic() + float(sys.argv[2])
    while not heard and time.monotonic() < end:
        node.poll(0.1)
    print(len(heard))
"""


@pytest.mark.parametrize(("reach", "seconds", "hears"), [("off", 3, "0"), ("localhost", 30, "1")])
def test_without_discovery_nobody_is_found(
    domain: int, monkeypatch: pytest.MonkeyPatch, reach: str, seconds: int, hears: str
):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", reach.upper())
    with DdsNode("near", Definitions(environment={}), domain + 16) as node:
        says = node.create_publisher("/chatter", "std_msgs/msg/String")
        command = [sys.executable, "-c", HEARD, str(domain + 16), str(seconds)]
        environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, cwd=ROOT) as other:
            while other.poll() is None:
                says.publish({"data": "x"})
                node.poll(0.05)
            assert other.stdout is not None
            assert other.stdout.read().strip() == hears
