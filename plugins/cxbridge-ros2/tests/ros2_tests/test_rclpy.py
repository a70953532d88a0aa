"""The transport rclpy: errors, and the tests of all transports in a sourced environment."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.errors import ConfigError, Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.settings import NodeSettings
from cxbridge_ros2.transports.environment import has_rclpy
from cxbridge_ros2.transports.rclpy import RclpyNode
from ros2_tests.conftest import make_ros_command, needs_ros
from tests.support import ROOT

FAST = "fastrtps" in os.environ.get("RMW_IMPLEMENTATION", "")
unsourced = pytest.mark.skipif(has_rclpy(), reason="a ROS 2 environment is sourced")


def run_in_ros(*command: str, timeout_s: float = 60) -> subprocess.CompletedProcess[str]:
    """Run this Python in the environment of ROS."""
    return subprocess.run(
        make_ros_command(sys.executable, *command),
        capture_output=True,
        text=True,
        timeout=timeout_s,
        cwd=ROOT,
        check=False,
    )


@needs_ros
def test_rclpy_passes_tests_of_all_transports(domain: int):
    result = run_in_ros(
        *(
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "plugins/cxbridge-ros2/tests/ros2_tests/test_transport.py",
        ),
        *("-k", "rclpy and not real and not dds and not rosbridge" + (" and message" if FAST else "")),
        timeout_s=240,
    )
    assert result.returncode == 0, result.stdout
    if FAST:
        return  # services do not work between Fast DDS and the peer, which uses the wheel of Cyclone DDS
    assert "skipped" not in result.stdout, domain
    assert result.stdout.count(".") > 10


@unsourced
def test_error_without_sourced_environment_has_hint():
    with pytest.raises(Ros2Error, match="rclpy is not installed: ") as caught:
        RclpyNode("test", Definitions(environment={}))
    assert re.match(r"source the setup\.bash of a ROS 2 for Python 3", caught.value.hint or "")


@unsourced
def test_dds_is_default_without_sourced_environment():
    assert NodeSettings.parse({}, Path(), "the robot").transport == "dds"
    with pytest.raises(ConfigError, match="'reach' belongs to the transport dds, not to rclpy"):
        NodeSettings.parse({"transport": "rclpy", "reach": "subnet"}, Path(), "the robot")


SETTINGS = """
    from pathlib import Path
    from cxbridge_ros2.settings import NodeSettings
    cases = ({}, {"domain": 3}, {"reach": "subnet"})
    transports = [NodeSettings.parse(each, Path(), "x").transport for each in cases]
    assert transports == ["rclpy", "rclpy", "dds"], transports
"""

FIELDS = """
    import sys
    from pathlib import Path
    from cxbridge.errors import Ros2Error
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.transports.rclpy import RclpyNode

    def error(make):
        try:
            make()
        except Ros2Error as error:
            return error.message
        raise AssertionError("no error")

    own = Path(sys.argv[1])
    with RclpyNode("test", Definitions([own]), 99) as node:
        changed = error(lambda: node.create_publisher("/a", "std_msgs/msg/Bool"))
        assert changed == "the sourced std_msgs/msg/Bool has the fields data, not data, more", changed
        changed = error(lambda: node.create_client("/a", "example_interfaces/srv/AddTwoInts"))
        assert changed.endswith("AddTwoInts_Request has the fields a, b, not a"), changed
        missing = error(lambda: node.create_publisher("/a", "own_msgs/msg/Own"))
        assert missing == "own_msgs/msg/Own has no Python class: No module named 'own_msgs'", missing
        unknown = error(lambda: node.create_publisher("/a", "std_msgs/msg/Bol"))
        assert unknown == "unknown ROS 2 type std_msgs/msg/Bol", unknown
        wrong = error(lambda: node.create_publisher("/b", "std_msgs/msg/String").publish({"dat": "x"}))
        assert "dat" in wrong, wrong
"""

ENDS = """
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.transports.rclpy import RclpyNode

    node, other = RclpyNode("one", Definitions(), 99), RclpyNode("two", Definitions(), 99)
    ends = [
        node.subscribe("/a", "std_msgs/msg/String", print),
        node.serve("/s", "std_srvs/srv/Trigger", lambda _: {}),
        node.create_publisher("/a", "std_msgs/msg/String").close,
        node.create_client("/s", "std_srvs/srv/Trigger").close,
    ]
    ends[0]()
    ends[0]()  # a second call has no effect
    node.close()
    node.close()
    for end in ends:
        end()
    got = []
    other.subscribe("/b", "std_msgs/msg/String", got.append)
    publisher = other.create_publisher("/b", "std_msgs/msg/String")
    publisher.publish({"data": "alive"})
    while not got:
        other.poll(0.1)
    other.close()
"""

LATER = """
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.transports.rclpy import RclpyNode

    with RclpyNode("server", Definitions(), 99) as server, RclpyNode("client", Definitions(), 99) as node:
        waiting, got = [], []
        server.serve_later("/s", "std_srvs/srv/SetBool", lambda each, reply: waiting.append((each, reply)))
        client = node.create_client("/s", "std_srvs/srv/SetBool")
        while not client.server_numbers:
            node.poll(0.05)
        assert len(client.server_numbers) == 1
        first, forgotten, last = (client.call({"data": flag}, got.append) for flag in (True, False, True))
        client.forget(forgotten)
        while len(waiting) < 3:
            server.poll(0.05)
        polls = 0
        import time
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            server.poll(0.1)
            polls += 1
        assert polls < 50, polls  # open requests do not keep the loop busy
        for number, (each, reply) in enumerate(waiting):
            reply({"success": each["data"], "message": str(number)})
        while len(got) < 2:
            node.poll(0.05)
        assert [each["message"] for each in got] == ["0", "2"], got
        server.close()
        end = time.monotonic() + 10
        while client.server_numbers:
            assert time.monotonic() < end
            node.poll(0.05)
"""


@needs_ros
@pytest.mark.parametrize("script", [SETTINGS, ENDS, LATER], ids=["settings", "ends", "later"])
def test_scripts_in_sourced_environment(script: str):
    result = run_in_ros("-c", textwrap.dedent(script))
    assert (result.returncode, result.stderr) == (0, ""), result.stderr


@needs_ros
def test_types_that_differ_from_environment_are_refused(tmp_path: Path):
    files = {
        "std_msgs/msg/Bool.msg": "bool data\nbool more\n",
        "example_interfaces/srv/AddTwoInts.srv": "int64 a\n---\nint64 sum\n",
        "own_msgs/msg/Own.msg": "bool data\n",
    }
    for name, text in files.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True)
        file.write_text(text)
        package = name.partition("/")[0]
        (tmp_path / package / "package.xml").write_text(f"<package><name>{package}</name></package>")
    result = run_in_ros("-c", textwrap.dedent(FIELDS), str(tmp_path))
    assert (result.returncode, result.stderr) == (0, ""), result.stderr


@needs_ros
def test_invalid_domain_is_refused():
    script = "from cxbridge_ros2.transports.rclpy import *; RclpyNode('a', Definitions(), 9999)"
    assert "Ros2Error: the domain 9999 does not exist: the highest is 232" in run_in_ros("-c", script).stderr
