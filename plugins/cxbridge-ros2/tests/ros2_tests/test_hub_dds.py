"""The hubs of PlanSys2 and of the thesis on DDS, with nodes of cxbridge and with C++ nodes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.clock import RealClock
from ros2_tests.conftest import HUBS, find_package, make_ros_command, needs_ros, start_peer
from ros2_tests.hub import CALLER, CALLERS, PERFORMER, World
from tests.support import ROOT

PACKAGES = {"plansys2": "plansys2_msgs", "skill-execution": "cx_msgs"}
SUCCEEDED = ("SUCCEEDED", "")
LIMIT_S = 60
WAYPOINTS = 7
CHECKOUT = os.environ.get("ROS2CX_2021_DIR", "")


@pytest.fixture(params=CALLERS)
def protocol(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def cpp_hub(protocol: str) -> None:
    """Skip tests without the C++ programs of PlanSys2 and of the thesis."""
    if find_package(PACKAGES[protocol]) is None:
        pytest.skip(f"this ROS 2 has no {PACKAGES[protocol]}")
    if not HUBS:
        pytest.skip("ROS2_HUBS names no folder in which with_rclcpp was built")


@pytest.fixture
def world(domain: int) -> Iterator[World]:
    world = World(RealClock())
    yield world
    world.close()


@pytest.fixture
def start_performers(
    cpp_hub: None, protocol: str, domain: int
) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Return a function that starts C++ performers."""
    processes = []

    def start(*names: str) -> subprocess.Popen[str]:
        processes.append(start_peer("rclcpp", f"{protocol}_performer", *names))
        return processes[-1]

    yield start
    for process in processes:
        with process:  # closes the pipes
            process.kill()


def read_output(process: subprocess.Popen[str]) -> list[str]:
    process.kill()
    return process.communicate()[0].splitlines()


def test_our_caller_commands_our_performer(world: World, protocol: str):
    caller = world.add_side(CALLER, CLASS=CALLERS[protocol])
    performer = world.add_side(PERFORMER, PROTOCOL=protocol)
    assert world.wait_for_ends(caller.request_skill("move", "r2", "hall")) == [SUCCEEDED]
    assert world.wait_for_ends(caller.request_skill("wave", "fail")) == [("FAILED", "door closed")]
    master = caller.request_skill("move", "long")
    world.wait_until(lambda: master.feedback)
    caller.service.local_calls.cancel(master.number)
    assert world.wait_for_ends(master)[0][0] == "CANCELLED"
    world.wait_until(lambda: "move was stopped" in performer.lines)
    assert world.wait_for_ends(caller.request_skill("move", "r2", "hall")) == [SUCCEEDED]


@needs_ros
def test_our_executive_commands_cpp_performers(
    world: World, protocol: str, start_performers: Callable[..., subprocess.Popen[str]]
):
    process = start_performers("one", "two")
    caller = world.add_side(CALLER, CLASS=CALLERS[protocol])
    feedback: list[str] = []
    calls = caller.service.local_calls
    master = calls.request(
        "move", {"1": "r2", "2": "hall"}, "robot1", lambda master: feedback.append(master.feedback)
    )
    assert world.wait_for_ends(master) == [SUCCEEDED]
    assert (master.feedback, "running" in feedback) == ("completed", True)
    assert world.wait_for_ends(caller.request_skill("move", "fail")) == [("FAILED", "door closed")]
    master = caller.request_skill("move", "long")
    world.wait_until(lambda: master.feedback)
    calls.cancel(master.number)
    assert world.wait_for_ends(master)[0][0] == "CANCELLED"
    for place in "abcdef":  # each performer still answers after a rejection
        assert world.wait_for_ends(caller.request_skill("move", place)) == [SUCCEEDED]
    lines = read_output(process)
    arguments = [" ".join(line.split()[2:]) for line in lines if "performs" in line]
    assert arguments == ["r2 hall", "fail", "long", *"abcdef"], lines
    assert sum("cancelled" in line for line in lines) == 1


@needs_ros
def test_killed_cpp_performer_fails_skill(
    world: World, protocol: str, start_performers: Callable[..., subprocess.Popen[str]]
):
    process = start_performers("one")
    caller = world.add_side(CALLER, CLASS=CALLERS[protocol])
    master = caller.request_skill("move", "long")
    world.wait_until(lambda: master.feedback)
    heartbeat_us = world.clock.now_us() + 1_500_000  # the first heartbeat of the performer
    world.wait_until(lambda: world.clock.now_us() > heartbeat_us)
    process.kill()
    assert world.wait_for_ends(master) == [("FAILED", "the performer one has vanished")]
    start_performers("one")
    assert world.wait_for_ends(caller.request_skill("move", "hall")) == [SUCCEEDED]


StartCaller = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start_caller(cpp_hub: None, protocol: str, domain: int) -> StartCaller:
    """Return a function that starts a C++ caller."""

    def start(*calls: str) -> subprocess.Popen[str]:
        command = make_ros_command(str(Path(HUBS) / f"{protocol}_caller"), *calls)
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)

    return start


@needs_ros
def test_our_skills_serve_cpp_executor(world: World, protocol: str, start_caller: StartCaller):
    performer = world.add_side(PERFORMER, PROTOCOL=protocol)
    process = start_caller("move,r2,hall", "wave,fail", "move,long", "move,a", "wave,b", "move,c")
    world.wait_until(lambda: process.poll() is not None, LIMIT_S)
    results: list[dict[str, Any]] = json.loads(process.communicate()[0])
    states = [(each["state"], each["status"]) for each in results]
    cancelled = ("CANCELLED", "") if protocol == "plansys2" else ("FAILURE", "CANCELLED")
    succeeded = ("SUCCESS", "arrived")
    assert states == [succeeded, ("FAILURE", "door closed"), cancelled, succeeded, succeeded, succeeded]
    assert [each["performer"] for each in results[:2]] == ["ours_move", "ours_wave"]
    assert all(each["feedback"] for each in results)
    assert "move was stopped" in performer.lines


NODES = """
skill-board:
  agents:
    default:
      executors:
        nodes: {class: "cxbridge_ros2.skill_execution:SkillExecutionSkills", skills: [move]}
"""


@needs_ros
@pytest.mark.skipif(not CHECKOUT, reason="ROS2CX_2021_DIR names no checkout of the thesis' executive")
@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_thesis_executive_drives_thesis_nodes(
    start_performers: Callable[..., subprocess.Popen[str]], tmp_path: Path
):
    process = start_performers("one")
    file = tmp_path / "nodes.yaml"
    file.write_text(NODES)
    command = [sys.executable, "-m", "cxbridge", "run", "--ros2cx", CHECKOUT, "--spec", "test-nav2"]
    command += ["--config", str(file), "--clock", "real", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=LIMIT_S, check=False)
    assert json.loads(run.stdout)["result"] == "completed", run.stderr
    drives = [" ".join(line.split()[2:]) for line in read_output(process) if "performs" in line]
    assert [drives[0], drives[-1]] == ["tb3 wp_init wp1", "tb3 wp6 wp_final"]
    assert len(drives) == WAYPOINTS


DAEMON = """
cxbridge: {executive: false, skiller: none, fawkes: {enable: false}, zmq: {endpoints: []}}
"""


@needs_ros
def test_daemon_serves_cpp_executor(protocol: str, start_caller: StartCaller, tmp_path: Path):
    file = tmp_path / "robots.yaml"
    file.write_text(DAEMON + PERFORMER.replace("PROTOCOL", protocol))
    daemon = subprocess.Popen([sys.executable, "-m", "cxbridge", "daemon", str(file)], cwd=ROOT)
    try:
        process = start_caller("move,a", "move,b")
        results = json.loads(process.communicate(timeout=LIMIT_S)[0])
        assert [each["state"] for each in results] == ["SUCCESS", "SUCCESS"]
    finally:
        daemon.terminate()
        assert daemon.wait(20) == 0
