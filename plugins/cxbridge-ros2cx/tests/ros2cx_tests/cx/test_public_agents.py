"""Unchanged public agents: ``CX_AGENTS_DIR`` names a folder with their checkouts.

The checkouts are clips_rcsml_agent, labcegor_BRANCH and expertino_BRANCH of carologistics, and
rcll-protobuf-msgs of robocup-logistics.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import pytest

from cxbridge.mainloop import Hook
from cxbridge.run import Run, run_scenario
from cxbridge.run.program.additions import Additions
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_protobuf.settings import CONNECTIONS_KEY
from cxbridge_ros2cx.cx.node import CxNode
from ros2cx_tests.cx.recordings import normalise, read_logs
from tests.support import CX_DIR, SHARED, needs_cx, needs_plugin

AGENTS = Path(os.environ.get("CX_AGENTS_DIR", ""))
MESSAGES = AGENTS / "rcll-protobuf-msgs"
RCSML = "clips_rcsml_agent"
REFBOX = Path(os.environ.get("REFBOX_DIR", ""))

pytestmark = [
    needs_cx,
    pytest.mark.skipif(not (AGENTS / RCSML).is_dir(), reason="CX_AGENTS_DIR names no folder with agents"),
]

PACKAGE = "rcll_protobuf_msgs"
BUILD = (
    f"project({PACKAGE})\nfind_package(ament_cmake REQUIRED)\n"
    "install(DIRECTORY rcll-protobuf-msgs DESTINATION share/${PROJECT_NAME})\nament_package()\n"
)


def make_workspace(folder, agent):
    """Make a workspace with the executive, an agent and the messages of the league."""
    messages = folder / "ws" / PACKAGE
    messages.mkdir(parents=True)
    (folder / "ws" / "executive").symlink_to(Path(str(CX_DIR)))
    (folder / "ws" / agent).symlink_to(AGENTS / agent)
    (messages / "package.xml").write_text(f'<package format="3"><name>{PACKAGE}</name></package>\n')
    (messages / "CMakeLists.txt").write_text(BUILD)
    (messages / "rcll-protobuf-msgs").symlink_to(MESSAGES)
    return folder / "ws"


def make_options(folder, agent, parameters, seconds):
    return options_from_keywords(
        AGENTS / agent / parameters,
        ros2cx=make_workspace(folder, agent),
        timeout=seconds,
        log_dir=folder / "logs",
    )


def read_log(folder, env):
    return (folder / "logs" / f"{env}.log").read_text().splitlines()


@pytest.mark.skipif(SHARED is None, reason="the recordings are absent")
def test_rcsml_agent_has_log_of_recording(tmp_path):
    result = run_scenario(make_options(tmp_path, RCSML, "config/config.yaml", 10))
    assert result.status == 0
    numbers = r"\d+\.\d+"
    ours = normalise(read_log(tmp_path, "rcsml_agent"), numbers)
    assert ours == normalise(read_logs("agent_clips_rcsml")["rcsml_agent"], numbers)


@needs_plugin("rcll")
@pytest.mark.skipif(not (REFBOX / "src").is_dir(), reason="REFBOX_DIR names no referee box")
def test_rcsml_agent_accepts_order_of_local_referee(tmp_path):
    from cxbridge_rcll.local_referee import LocalReferee
    from cxbridge_rcll.refbox import Refbox

    referee = LocalReferee(Refbox.open(REFBOX), MESSAGES, (), 1)
    parts = tuple(referee.component_factories("Carologistics", 60))
    additions = Additions(values={CONNECTIONS_KEY: referee.make_connections})
    run_options = make_options(tmp_path, RCSML, "config/config.yaml", 30)
    with Run(run_options, None, None, additions, parts) as run:
        run.start()
        begun_us = run.clock.now_us()
        run.loop.run(lambda: run.clock.now_us() > begun_us + 25_000_000)
    text = "\n".join(read_log(tmp_path, "rcsml_agent"))
    assert "Enabling local peer (cyan only)" in text
    assert re.search(r"Starting order from refbox: \d", text)
    assert re.search(r"Created action-plan\. Consisting of \d+ tasks", text)
    assert "Sent task (Move) with id 0 to robot 1!" in text
    assert not referee.faults


class Turtle:
    """A turtle that drives for a second after each command."""

    def __init__(self, node):
        self.x, self.y, self.theta = 5.5, 5.5, 0.0
        self.speed, self.turn, self.stop_s, self.last_s = 0.0, 0.0, 0.0, 0.0
        self.path: list[tuple[float, float]] = []
        self.pose = node.create_publisher("/turtle1/pose", "turtlesim/msg/Pose")
        node.subscribe("/turtle1/cmd_vel", "geometry_msgs/msg/Twist", self.command)

    def command(self, message):
        self.speed, self.turn = message["linear"]["x"], message["angular"]["z"]
        self.stop_s = self.last_s + 1.0

    def step(self, seconds):
        passed, self.last_s = seconds - self.last_s, seconds
        if seconds > self.stop_s + 0.001:
            self.speed = self.turn = 0.0
        self.theta = math.remainder(self.theta + self.turn * passed, 2 * math.pi)
        self.x += self.speed * passed * math.cos(self.theta)
        self.y += self.speed * passed * math.sin(self.theta)
        self.path.append((self.x, self.y))
        moving = {"linear_velocity": self.speed, "angular_velocity": self.turn}
        self.pose.publish({"x": self.x, "y": self.y, "theta": self.theta, **moving})


def test_course_agent_drives_turtle_to_corners(tmp_path):
    turtles: list[Turtle] = []

    def attach(assembly):
        assert isinstance(assembly.executive, CxNode)
        turtles.append(Turtle(assembly.executive.manager.context.ros.graph.join("turtlesim")))
        begun_us = assembly.clock.now_us()
        assembly.loop.add(Hook.PRE_LOOP, lambda: turtles[0].step((assembly.clock.now_us() - begun_us) / 1e6))

    agent = "labcegor_main"
    run_options = make_options(tmp_path, agent, "labcegor_bringup/params/task3.yaml", 60)
    assert run_scenario(run_options, attach=attach).status == 0
    assert sum("Goal reached" in line for line in read_log(tmp_path, "task3")) >= 3
    for corner in ((1.0, 1.0), (9.0, 1.0), (9.0, 9.0)):
        assert min(math.dist(corner, position) for position in turtles[0].path) < 0.15


COURSE_AGENTS = [
    (f"labcegor_{branch}", f"labcegor_bringup/params/{name}.yaml", status)
    for branch, names in {
        "main": {"rcll": 0, "task3": 0},
        "cmuehrke_main": {"rcll": 0, "task3": 0, "task4": 1},  # a rule prints the missing fact f-0
        "fwittlinger_felix_main": {"rcll": 0, "task3": 0},
        "afranken_agent": {"rcll": 0, "task3": 0, "clips_env_manager": 0},
        "twendt_agent": {"rcll": 0},
    }.items()
    for name, status in names.items()
]


@pytest.mark.parametrize(("agent", "parameters", "status"), COURSE_AGENTS)
def test_course_agent_exits_with_expected_status(agent, parameters, status, tmp_path):
    result = run_scenario(make_options(tmp_path, agent, parameters, 10))
    assert result.status == status, result.reason
    if status:
        assert "Unable to find fact f-0" in result.reason


STARTED = "start-task-startup-completed"
BRANCHES = {
    "common_agent": STARTED,
    "hgrover_execution-monitoring-new": STARTED,
    "skalra_stitch-agenda": STARTED,
    "tviehmann_pddl-update": "Unknown type: r - task",  # the domain lacks the type
}


@pytest.mark.parametrize(("branch", "line"), BRANCHES.items())
def test_expertino_agent_starts_with_our_pddl_manager(branch, line, tmp_path):
    """The parameters name a package of an earlier executive, so the agent starts after an error."""
    pytest.importorskip("jinja2")
    result = run_scenario(
        make_options(tmp_path, f"expertino_{branch}", "expertino/params/clips_env_manager.yaml", 20)
    )
    assert "names a package that does not exist: cx_goal_reasoning" in result.reason
    assert line in "\n".join(read_log(tmp_path, "main"))
