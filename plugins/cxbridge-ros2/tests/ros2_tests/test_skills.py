"""Skills that are actions of ROS 2: the waypoints scenario with Fibonacci goals or drives."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError, SkillError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.board import SkillCall
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge_ros2.skills import RosSkills, fill_template
from cxbridge_ros2.transports.dds.domain import _make_local_configuration
from ros2_tests.conftest import SETUP, kill_peer, needs_ros, run_module, start_peer
from ros2_tests.peer import PACKAGES
from tests.forked import Piped, nursery
from tests.support import ROOT

WAYPOINTS = 7
SHORT_LEASE = _make_local_configuration("localhost").replace(
    "<Discovery>", "<Discovery><LeaseDuration>2s</LeaseDuration>"
)
"""A configuration of DDS with which nodes drop a silent process after two seconds instead of ten."""
EXECUTOR = f"""
          class: cxbridge_ros2.skills:RosSkills
          packages: ["{PACKAGES}"]
          tables:
            to: {{wp1: 2, wp2: 3, wp3: 4, wp4: 5, wp5: 6, wp6: 7, wp-final: LAST}}
          skills:
            move:
              action: example_interfaces/action/Fibonacci
              name: /fibonacci
              goal: {{order: $to}}
              patience: 1.0
"""


def write_scenario(parent: Path, last: int) -> Path:
    """Write the waypoints scenario with Fibonacci goals in place of drives.

    :param last: the order of the last goal.
    """
    folder = parent / "waypoints"
    shutil.copytree(ROOT / "scenarios/waypoints", folder)
    text = (folder / "scenario.yaml").read_text()
    before = text[: text.index("          class: cxbridge.skiller")]
    (folder / "scenario.yaml").write_text(before + EXECUTOR.lstrip("\n").replace("LAST", str(last)))
    return folder


DRIVE_EXECUTOR = """
          class: cxbridge_ros2.skills:RosSkills
          packages: ["SHARE"]
          tables:
            to:
              wp1: {position: {x: 0.8}}
              wp2: {position: {x: 1.6, y: 0.3}}
              wp3: {position: {x: 1.8, y: 1.1}}
              wp4: {position: {x: 1.2, y: 1.7}}
              wp5: {position: {x: 0.4, y: 1.7}}
              wp6: {position: {x: -0.2, y: 1.1}}
              wp-final: {position: {x: -0.2, y: 0.4}}
          skills:
            move:
              action: nav2_msgs/action/NavigateToPose
              name: /navigate_to_pose
              goal: {pose: {header: {frame_id: map}, pose: $to}}
              feedback: distance_remaining
              patience: 5.0
"""


@pytest.fixture
def navigation(tmp_path: Path) -> Path:
    """Write a scenario with drives by NavigateToPose."""
    share = Path(SETUP) / "share/nav2_msgs"
    if not share.is_dir():
        pytest.skip("this ROS 2 has no nav2_msgs")
    folder = write_scenario(tmp_path, 8)
    file = folder / "scenario.yaml"
    before = file.read_text().partition("          class: cxbridge_ros2")[0]
    file.write_text(before + DRIVE_EXECUTOR.lstrip("\n").replace("SHARE", str(share)))
    return folder


def read_drives(process: subprocess.Popen[str]) -> Iterator[str]:
    """Yield the lines about drives in the output of the robot."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("drive to"):
            yield line.strip()


@needs_ros
@pytest.mark.usefixtures("quiet_domain")
def test_rclpy_robot_drives_to_waypoints(navigation: Path):
    robot = start_peer("rclpy", "navigate.py")
    status, result, errors = finish_run(start_run(navigation))
    assert (status, result["result"]) == (0, "completed"), errors
    robot.kill()
    drives = [line for line in robot.communicate()[0].splitlines() if line.startswith("drive to")]
    assert drives[0] == "drive to map 0.8 0.0 1.0"
    assert drives[-1] == "drive to map -0.2 0.4 1.0"
    assert len(drives) == WAYPOINTS


@needs_ros
@pytest.mark.usefixtures("quiet_domain")
def test_restarted_rclpy_robot_fails_skill(navigation: Path):
    robot = start_peer("rclpy", "navigate.py")
    process = start_run(navigation)
    drives = read_drives(robot)
    assert [next(drives) for _ in range(3)][-1] == "drive to map 1.8 1.1 1.0"
    kill_peer(robot)
    robot = start_peer("rclpy", "navigate.py")
    status, _, errors = finish_run(process)
    kill_peer(robot)
    assert status == 1
    assert "the server of /navigate_to_pose does not know the goal, since it was restarted" in errors


def start_run(folder: Path, *options: str) -> Piped:
    return nursery().begin(["run", str(folder), "--clock", "real", "--json", *options])


def finish_run(process: Piped) -> tuple[int, dict[str, Any], str]:
    with process.process, process.stdin, process.stdout, process.stderr:
        errors = process.stderr.read().decode()  # standard output is too short to fill its pipe
        out = process.stdout.read()
        return process.process.wait(60), json.loads(out or "{}"), errors


def test_action_server_executes_all_skills(peer: str, tmp_path: Path):
    status, result, errors = finish_run(start_run(write_scenario(tmp_path, 8)))
    assert (status, result["result"]) == (0, "completed"), (peer, errors)


def test_aborted_goal_fails_skill_and_names_action(peer: str, tmp_path: Path):
    status, _, errors = finish_run(start_run(write_scenario(tmp_path, 13)))
    assert status == 1, (peer, errors)
    assert "/fibonacci: ABORTED" in errors


@pytest.fixture
def quiet_domain(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Set a domain without nodes."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain + 16))


@pytest.mark.usefixtures("quiet_domain")
def test_missing_server_fails_skill_and_names_action(tmp_path: Path):
    status, _, errors = finish_run(start_run(write_scenario(tmp_path, 8)))
    assert status == 1
    assert "/fibonacci (example_interfaces/action/Fibonacci) has no server" in errors


@pytest.mark.usefixtures("quiet_domain")
def test_vanished_server_fails_skill_and_names_action(tmp_path: Path):
    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("CYCLONEDDS_URI", SHORT_LEASE)
            stack.enter_context(run_module("ros2_tests.peer"))
        process = start_run(write_scenario(tmp_path, 45), "--verbose")
        executed = (line for line in process.stderr if b"is executed by" in line)
        assert len([*islice(executed, WAYPOINTS)]) == WAYPOINTS
    status, _, errors = finish_run(process)
    assert status == 1
    # the server vanishes before or after it accepts the last goal
    assert (
        "the server of /fibonacci has vanished" in errors
        or "/fibonacci (example_interfaces/action/Fibonacci) has no server" in errors
    )


def make_executor(settings: dict[str, Any]) -> RosSkills:
    clock = VirtualClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    return RosSkills(
        ExecutorContext("robot1", board, clock, EventBus(clock).logger("test"), settings, Path())
    )


INVALID_SETTINGS: dict[str, tuple[dict[str, Any], str]] = {
    "no skills": ({}, "has no skills"),
    "neither action nor service": (
        {"skills/go/name": "/go"},
        "the skill go is neither an action nor a service",
    ),
    "action and service": (
        {"skills/go/action": "a/action/B", "skills/go/service": "a/srv/B"},
        "is neither an action",
    ),
    "unknown key": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "skills/go/goals": 1},
        "the skill go has no setting 'goals'",
    ),
    "relative name": (
        {"skills/go/action": "a/action/B", "skills/go/name": "go"},
        "'go' is not an absolute name",
    ),
    "timeout": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "skills/go/timeout": 0},
        "the timeout of the skill go must be a positive number of seconds, not 0",
    ),
    "relative namespace": ({"namespace": "robot1"}, "'robot1' is not an absolute name"),
    "unknown setting": ({"skill": 1}, "has no setting 'skill'"),
    "missing folder": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "packages": "/nowhere"},
        "no such folder",
    ),
}


@pytest.mark.parametrize("case", INVALID_SETTINGS)
def test_invalid_settings_are_refused(case: str):
    settings, message = INVALID_SETTINGS[case]
    with pytest.raises(CxbridgeError) as caught:
        make_executor(settings)
    assert message in str(caught.value)


def test_unknown_type_is_reported_at_start_of_run(tmp_path: Path):
    folder = write_scenario(tmp_path, 8)
    file = folder / "scenario.yaml"
    file.write_text(file.read_text().replace("action/Fibonacci", "action/Fibonaci"))
    status, _, errors = finish_run(start_run(folder))
    assert status == 2
    assert "unknown ROS 2 type example_interfaces/action/Fibonaci" in errors
    assert "did you mean example_interfaces/action/Fibonacci" in errors
    assert "scenario.yaml:" in errors


def test_template_is_filled_with_parameters():
    call = SkillCall("go", "robot1", {"x": 1.5, "place": "kitchen", "n": 3})
    tables = {"place": {"kitchen": {"x": 7}}}
    template = {"a": "$x", "b": ["$n", "at $x, ${n}nd"], "c": {"d": "$place"}, "e": 4}
    assert fill_template(template, call, tables) == {
        "a": 1.5,
        "b": [3, "at 1.5, 3nd"],
        "c": {"d": {"x": 7}},
        "e": 4,
    }
    with pytest.raises(SkillError, match="go needs the parameter 'y'"):
        fill_template({"a": "$y"}, call, {})
    with pytest.raises(SkillError, match="the table 'place' has no entry 'kitchen'"):
        fill_template("$place", call, {"place": {"kitchn": 1}})


def test_namespace_is_prefix_of_names():
    ros_skills = make_executor(
        {"namespace": "/robot1", "skills/go/action": "a/action/B", "skills/go/name": "/go"}
    )
    assert ros_skills._skills["go"].name == "/robot1/go"
