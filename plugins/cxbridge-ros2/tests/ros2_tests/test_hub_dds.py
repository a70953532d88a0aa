"""The hubs of PlanSys2 and of the thesis on DDS: ours with ours, and with the C++ of both."""

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
from ros2_tests.conftest import HUBS, find_package, in_ros, needs_ros, start
from ros2_tests.hub import CALLER, CALLERS, PERFORMER, World
from tests.support import ROOT

PACKAGES = {"plansys2": "plansys2_msgs", "skill-execution": "cx_msgs"}
THERE = ("SUCCEEDED", "")
LIMIT_S = 60
WAYS = 7
CHECKOUT = os.environ.get("ROS2CX_2021_DIR", "")


@pytest.fixture(params=CALLERS)
def protocol(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def stranger(protocol: str) -> None:
    """Skip a test that needs the C++ of PlanSys2 and of the thesis."""
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
def performers(stranger: None, protocol: str, domain: int) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts performers of strangers."""
    made = []

    def begin(*names: str) -> subprocess.Popen[str]:
        made.append(start("rclcpp", f"{protocol}_performer", *names))
        return made[-1]

    yield begin
    for process in made:
        with process:  # its pipes are closed, too
            process.kill()


def said(process: subprocess.Popen[str]) -> list[str]:
    process.kill()
    return process.communicate()[0].splitlines()


def test_ours_with_ours(world: World, protocol: str):
    here = world.side(CALLER, CLASS=CALLERS[protocol])
    there = world.side(PERFORMER, PROTOCOL=protocol)
    assert world.over(here.ask("move", "r2", "hall")) == [THERE]
    assert world.over(here.ask("wave", "fail")) == [("FAILED", "door closed")]
    master = here.ask("move", "long")
    world.until(lambda: master.feedback)
    here.service.local_calls.stop(master.number)
    assert world.over(master)[0][0] == "CANCELLED"
    world.until(lambda: "move was stopped" in there.lines)
    assert world.over(here.ask("move", "r2", "hall")) == [THERE]


@needs_ros
def test_our_executive_commands_performers_of_strangers(
    world: World, protocol: str, performers: Callable[..., subprocess.Popen[str]]
):
    process = performers("one", "two")
    here = world.side(CALLER, CLASS=CALLERS[protocol])
    told: list[str] = []
    calls = here.service.local_calls
    master = calls.ask(
        "move", {"1": "r2", "2": "hall"}, "robot1", lambda master: told.append(master.feedback)
    )
    assert world.over(master) == [THERE]
    assert (master.feedback, "running" in told) == ("completed", True)
    assert world.over(here.ask("move", "fail")) == [("FAILED", "door closed")]
    master = here.ask("move", "long")
    world.until(lambda: master.feedback)
    calls.stop(master.number)
    assert world.over(master)[0][0] == "CANCELLED"
    for place in "abcdef":  # no performer became deaf, whichever answered second
        assert world.over(here.ask("move", place)) == [THERE]
    lines = said(process)
    done = [" ".join(line.split()[2:]) for line in lines if "performs" in line]
    assert done == ["r2 hall", "fail", "long", *"abcdef"], lines
    assert sum("cancelled" in line for line in lines) == 1


@needs_ros
def test_a_performer_of_strangers_that_is_killed_fails_the_skill(
    world: World, protocol: str, performers: Callable[..., subprocess.Popen[str]]
):
    process = performers("one")
    here = world.side(CALLER, CLASS=CALLERS[protocol])
    master = here.ask("move", "long")
    world.until(lambda: master.feedback)
    end = world.clock.now_us() + 1_500_000  # until it has given a sign of life
    world.until(lambda: world.clock.now_us() > end)
    process.kill()
    assert world.over(master) == [("FAILED", "the performer one has vanished")]
    performers("one")
    assert world.over(here.ask("move", "hall")) == [THERE]


Calling = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def calling(stranger: None, protocol: str, domain: int) -> Calling:
    """Starts a caller of strangers."""

    def begin(*calls: str) -> subprocess.Popen[str]:
        command = in_ros(str(Path(HUBS) / f"{protocol}_caller"), *calls)
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)

    return begin


@needs_ros
def test_our_skills_serve_an_executor_of_strangers(world: World, protocol: str, calling: Calling):
    there = world.side(PERFORMER, PROTOCOL=protocol)
    process = calling("move,r2,hall", "wave,fail", "move,long", "move,a", "wave,b", "move,c")
    world.until(lambda: process.poll() is not None, LIMIT_S)
    found: list[dict[str, Any]] = json.loads(process.communicate()[0])
    states = [(each["state"], each["status"]) for each in found]
    end = ("CANCELLED", "") if protocol == "plansys2" else ("FAILURE", "CANCELLED")
    there_is = ("SUCCESS", "there")
    assert states == [there_is, ("FAILURE", "door closed"), end, there_is, there_is, there_is]
    assert [each["performer"] for each in found[:2]] == ["ours_move", "ours_wave"]
    assert all(each["feedback"] for each in found)
    assert "move was stopped" in there.lines


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
def test_the_executive_of_the_thesis_drives_its_nodes(
    performers: Callable[..., subprocess.Popen[str]], tmp_path: Path
):
    process = performers("one")
    file = tmp_path / "nodes.yaml"
    file.write_text(NODES)
    command = [sys.executable, "-m", "cxbridge", "run", "--ros2cx", CHECKOUT, "--spec", "test-nav2"]
    command += ["--config", str(file), "--clock", "real", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=LIMIT_S, check=False)
    assert json.loads(run.stdout)["result"] == "completed", run.stderr
    driven = [" ".join(line.split()[2:]) for line in said(process) if "performs" in line]
    assert [driven[0], driven[-1]] == ["tb3 wp_init wp1", "tb3 wp6 wp_final"]
    assert len(driven) == WAYS


DAEMON = """
cxbridge: {executive: false, skiller: none, fawkes: {enable: false}, zmq: {endpoints: []}}
"""


@needs_ros
def test_a_daemon_serves_an_executor_of_strangers(protocol: str, calling: Calling, tmp_path: Path):
    file = tmp_path / "robots.yaml"
    file.write_text(DAEMON + PERFORMER.replace("PROTOCOL", protocol))
    daemon = subprocess.Popen([sys.executable, "-m", "cxbridge", "daemon", str(file)], cwd=ROOT)
    try:
        process = calling("move,a", "move,b")
        found = json.loads(process.communicate(timeout=LIMIT_S)[0])
        assert [each["state"] for each in found] == ["SUCCESS", "SUCCESS"]
    finally:
        daemon.terminate()
        assert daemon.wait(20) == 0
