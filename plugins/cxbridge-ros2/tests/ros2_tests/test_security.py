"""DDS security: with rclpy by the keystore of ROS; DDS by the wheel refuses to go without."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("cryptography", reason="needs cryptography, which writes the keystore")

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import in_ros, needs_ros
from ros2_tests.keystore import write_keystore
from tests.support import ROOT

PLUGINS = os.environ.get("DDS_SECURITY_DIR", "")
"""The folder with libdds_security_auth.so and the like, of the Cyclone DDS that ROS was built with."""

CHAT = """
import sys, time
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.rclpy import RclpyNode

name = sys.argv[1]
with RclpyNode(name, Definitions(), int(sys.argv[2])) as node:
    heard = set()
    node.subscribe("/chat", "std_msgs/msg/String", lambda message: heard.add(message["data"]))
    says = node.publisher("/chat", "std_msgs/msg/String")
    end = time.monotonic() + 30
    while time.monotonic() < end and len(heard) < int(sys.argv[3]):
        says.publish({"data": name})
        node.poll(0.1)
    for _ in range(20):
        says.publish({"data": name})
        node.poll(0.1)
print(*sorted(heard))
"""


def test_dds_by_the_wheel_does_not_go_without(monkeypatch: pytest.MonkeyPatch, domain: int):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    with pytest.raises(Ros2Error, match="built without DDS security") as raised:
        DdsNode("one", Definitions(environment={}), domain + 17)
    assert raised.value.hint == "use the transport rclpy in a sourced ROS 2"


def test_where_it_may_go_without_it_says_so(monkeypatch: pytest.MonkeyPatch, domain: int):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    said: list[str] = []
    with DdsNode("one", Definitions(environment={}), domain + 17, report=said.append):
        assert [each.rpartition(", so no data is encrypted")[1] for each in said] == [
            ", so no data is encrypted"
        ]


@needs_ros
@pytest.mark.skipif(not PLUGINS, reason="DDS_SECURITY_DIR names no folder with the plug-ins of DDS security")
def test_those_with_keys_hear_each_other_and_nobody_else(tmp_path: Path, domain: int):
    write_keystore(tmp_path, "/ours", "/theirs")
    usual = {
        **os.environ,
        "LD_LIBRARY_PATH": PLUGINS,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    secure = {
        **usual,
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(tmp_path),
    }

    def start(name: str, voices: int, environment: dict[str, str]) -> subprocess.Popen[str]:
        command = in_ros(sys.executable, "-c", CHAT, name, str(domain + 17), str(voices))
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, cwd=ROOT)

    ours = start("ours", 2, {**secure, "ROS_SECURITY_ENCLAVE_OVERRIDE": "/ours"})
    theirs = start("theirs", 2, {**secure, "ROS_SECURITY_ENCLAVE_OVERRIDE": "/theirs"})
    stranger = start("stranger", 1, usual)
    heard = [each.communicate(timeout=120)[0].split() for each in (ours, theirs, stranger)]
    assert heard == [["ours", "theirs"], ["ours", "theirs"], ["stranger"]]
