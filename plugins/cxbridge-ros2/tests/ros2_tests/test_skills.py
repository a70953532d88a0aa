"""Skills that are actions of ROS 2: the waypoints of the thesis, driven by a node that counts."""

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
from ros2_tests.conftest import SETUP, forked, needs_ros, start, stop
from ros2_tests.peer import PACKAGES
from tests.forked import Piped, nursery
from tests.support import ROOT

WAYS = 7
MISSED_SOON = _make_local_configuration("localhost").replace(
    "<Discovery>", "<Discovery><LeaseDuration>2s</LeaseDuration>"
)
"""Makes other nodes drop a process when they hear nothing for two seconds, not ten."""
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


def scenario(folder: Path, last: int) -> Path:
    """Write the waypoints with counting in place of driving; the last way is a goal of that order."""
    made = folder / "waypoints"
    shutil.copytree(ROOT / "scenarios/waypoints", made)
    text = (made / "scenario.yaml").read_text()
    before = text[: text.index("          class: cxbridge.skiller")]
    (made / "scenario.yaml").write_text(before + EXECUTOR.lstrip("\n").replace("LAST", str(last)))
    return made


DRIVE = """
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
    """A scenario that drives by NavigateToPose."""
    share = Path(SETUP) / "share/nav2_msgs"
    if not share.is_dir():
        pytest.skip("this ROS 2 has no nav2_msgs")
    folder = scenario(tmp_path, 8)
    file = folder / "scenario.yaml"
    before = file.read_text().partition("          class: cxbridge_ros2")[0]
    file.write_text(before + DRIVE.lstrip("\n").replace("SHARE", str(share)))
    return folder


def places(process: subprocess.Popen[str]) -> Iterator[str]:
    """Yield where the robot is sent, line by line."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("drive to"):
            yield line.strip()


@needs_ros
@pytest.mark.usefixtures("quiet_domain")
def test_the_waypoints_are_driven_by_navigate_to_pose_of_rclpy(navigation: Path):
    robot = start("rclpy", "navigate.py")
    status, result, errors = end(begin(navigation))
    assert (status, result["result"]) == (0, "completed"), errors
    robot.kill()
    way = [line for line in robot.communicate()[0].splitlines() if line.startswith("drive to")]
    assert way[0] == "drive to map 0.8 0.0 1.0"
    assert way[-1] == "drive to map -0.2 0.4 1.0"
    assert len(way) == WAYS


@needs_ros
@pytest.mark.usefixtures("quiet_domain")
def test_a_robot_that_is_restarted_in_the_middle_fails_a_skill_with_a_reason(navigation: Path):
    robot = start("rclpy", "navigate.py")
    running = begin(navigation)
    on_its_way = places(robot)
    assert [next(on_its_way) for _ in range(3)][-1] == "drive to map 1.8 1.1 1.0"
    stop(robot)
    robot = start("rclpy", "navigate.py")
    status, _, errors = end(running)
    stop(robot)
    assert status == 1
    assert "the server of /navigate_to_pose does not know the goal, since it was restarted" in errors


def begin(folder: Path, *options: str) -> Piped:
    return nursery().begin(["run", str(folder), "--clock", "real", "--json", *options])


def end(running: Piped) -> tuple[int, dict[str, Any], str]:
    with running.process, running.stdin, running.stdout, running.stderr:
        errors = running.stderr.read().decode()  # far less than a pipe holds goes to the other one
        out = running.stdout.read()
        return running.process.wait(60), json.loads(out or "{}"), errors


def test_a_robot_of_ros_drives_all_waypoints(peer: str, tmp_path: Path):
    status, result, errors = end(begin(scenario(tmp_path, 8)))
    assert (status, result["result"]) == (0, "completed"), (peer, errors)


def test_a_goal_that_is_aborted_is_a_failure_that_names_it(peer: str, tmp_path: Path):
    status, _, errors = end(begin(scenario(tmp_path, 13)))
    assert status == 1, (peer, errors)
    assert "/fibonacci: ABORTED" in errors


@pytest.fixture
def quiet_domain(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Set a domain without any node."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain + 16))


@pytest.mark.usefixtures("quiet_domain")
def test_a_server_that_is_not_there_is_a_failure_that_names_it(tmp_path: Path):
    status, _, errors = end(begin(scenario(tmp_path, 8)))
    assert status == 1
    assert "/fibonacci (example_interfaces/action/Fibonacci) has no server" in errors


@pytest.mark.usefixtures("quiet_domain")
def test_a_server_that_vanishes_is_a_failure_that_names_it(tmp_path: Path):
    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("CYCLONEDDS_URI", MISSED_SOON)
            stack.enter_context(forked("ros2_tests.peer"))
        running = begin(scenario(tmp_path, 45), "--verbose")
        executed = (line for line in running.stderr if b"is executed by" in line)
        assert len([*islice(executed, WAYS)]) == WAYS
    status, _, errors = end(running)
    assert status == 1
    # the last goal was on its way
    assert (
        "the server of /fibonacci has vanished" in errors
        or "/fibonacci (example_interfaces/action/Fibonacci) has no server" in errors
    )


def executor(settings: dict[str, Any]) -> RosSkills:
    clock = VirtualClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    return RosSkills(
        ExecutorContext("robot1", board, clock, EventBus(clock).logger("test"), settings, Path())
    )


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no skills": ({}, "has no skills"),
    "neither": ({"skills/go/name": "/go"}, "the skill go is neither an action nor a service"),
    "both": ({"skills/go/action": "a/action/B", "skills/go/service": "a/srv/B"}, "is neither an action"),
    "an unknown key": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "skills/go/goals": 1},
        "the skill go has no setting 'goals'",
    ),
    "no whole name": (
        {"skills/go/action": "a/action/B", "skills/go/name": "go"},
        "'go' is not an absolute name",
    ),
    "a timeout": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "skills/go/timeout": 0},
        "the timeout of the skill go must be a positive number of seconds, not 0",
    ),
    "a namespace": ({"namespace": "robot1"}, "'robot1' is not an absolute name"),
    "an unknown setting": ({"skill": 1}, "has no setting 'skill'"),
    "no folder": (
        {"skills/go/action": "a/action/B", "skills/go/name": "/go", "packages": "/nowhere"},
        "no such folder",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_configuration_is_one_error(case: str):
    settings, words = WRONG[case]
    with pytest.raises(CxbridgeError) as caught:
        executor(settings)
    assert words in str(caught.value)


def test_an_unknown_type_is_told_when_the_run_begins(tmp_path: Path):
    folder = scenario(tmp_path, 8)
    file = folder / "scenario.yaml"
    file.write_text(file.read_text().replace("action/Fibonacci", "action/Fibonaci"))
    status, _, errors = end(begin(folder))
    assert status == 2
    assert "unknown ROS 2 type example_interfaces/action/Fibonaci" in errors
    assert "did you mean example_interfaces/action/Fibonacci" in errors
    assert "scenario.yaml:" in errors


def test_parameters_fill_a_message():
    call = SkillCall("go", "robot1", {"x": 1.5, "place": "kitchen", "n": 3})
    tables = {"place": {"kitchen": {"x": 7}}}
    message = {"a": "$x", "b": ["$n", "at $x, ${n}nd"], "c": {"d": "$place"}, "e": 4}
    assert fill_template(message, call, tables) == {
        "a": 1.5,
        "b": [3, "at 1.5, 3nd"],
        "c": {"d": {"x": 7}},
        "e": 4,
    }
    with pytest.raises(SkillError, match="go needs the parameter 'y'"):
        fill_template({"a": "$y"}, call, {})
    with pytest.raises(SkillError, match="the table 'place' has no entry 'kitchen'"):
        fill_template("$place", call, {"place": {"kitchn": 1}})


def test_a_namespace_comes_before_names():
    made = executor({"namespace": "/robot1", "skills/go/action": "a/action/B", "skills/go/name": "/go"})
    assert made._skills["go"].name == "/robot1/go"
