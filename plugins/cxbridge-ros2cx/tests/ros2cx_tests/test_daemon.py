"""A daemon with the executive of the thesis."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Any

import pytest

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.run.program.plain_options import take_plugin_options
from tests.daemon.test_daemon import QUIET
from tests.support import ROS2CX_DIR, needs_plugin, needs_ros2cx

pytestmark = needs_ros2cx

FAST = ("clock", "scaled:20")
ENV = "/api/cxbridge/environments/executive"


def make_options(**changes: Any) -> DaemonOptions:
    settings = {"ros2cx": ROS2CX_DIR, "spec": "test-nav2", "settings": QUIET} | changes
    return DaemonOptions(plugin_groups=tuple(take_plugin_options(settings)), **settings)


def wait_for(pattern: str, lines: list[str], start: int = 0) -> None:
    """Wait until a line of the log matches a pattern."""
    pause = threading.Event()
    for _ in range(1200):
        if any(re.search(pattern, line) for line in lines[start:]):
            return
        pause.wait(0.05)
    raise AssertionError(f"no line matches {pattern}")


@needs_plugin("studio")
@needs_plugin("web")
def test_clients_see_plan_and_moves():
    from web_tests.support import serving

    with serving(
        (FAST,), plugin_groups=tuple(take_plugin_options({"ros2cx": ROS2CX_DIR})), spec="test-nav2"
    ) as (
        _,
        client,
        lines,
    ):
        components = [entry["name"] for entry in client.get("/api/cxbridge/status").json["components"]]
        assert components.index("skill-board") < components.index("executive") == len(components) - 1
        wait_for("Action move is running", lines)
        (goal,) = client.get("/api/clips-executive/goals").json
        assert (goal["id"], goal["mode"]) == ("TESTGOAL", "DISPATCHED")
        (plan,) = client.get("/api/clips-executive/plans").json
        actions = client.get(f"/api/clips-executive/plans/TESTGOAL/{plan['id']}").json["actions"]
        assert [action["operator-name"] for action in actions] == ["move"] * 7
        features = {feature["name"] for feature in client.get("/api/cxbridge/features").json}
        assert {"plansys2", "clips_pddl_parser", "skill_execution"} <= features
        wait_for("TESTGOAL.* completed", lines)
        at_goal = "(any-factp ((?f domain-fact)) (eq ?f:param-values (create$ tb3 wp_final)))"
        assert client.ask("POST", f"{ENV}/eval", {"expression": at_goal}).json["text"] == "TRUE"


@needs_plugin("web")
def test_executors_serve_run_after_reset(tmp_path):
    """A reset makes a new skill board, which must find the executors."""

    from web_tests.support import serving

    file = tmp_path / "robot.py"
    file.write_text(
        "from cxbridge.skiller.board import SkillExecutor\n"
        "class Move(SkillExecutor):\n"
        "    def execute(self, call):\n"
        "        self.log.info('the robot moves')\n"
        "        yield 0.5\n"
    )
    groups = tuple(take_plugin_options({"ros2cx": ROS2CX_DIR, "executors": (f"move={file}:Move",)}))
    with serving((FAST,), plugin_groups=groups, spec="test-nav2") as (_, client, lines):
        wait_for("TESTGOAL.* completed", lines)
        start = len(lines)
        assert client.ask("POST", "/api/cxbridge/reset").status == 200
        wait_for("the robot moves", lines, start)
        wait_for("TESTGOAL.* completed", lines, start)
        assert not any("dummy" in line for line in lines)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"config": Path()}, "--ros2cx cannot be combined with a scenario or --fawkes-dir"),
        ({"fawkes_dir": Path()}, "--ros2cx cannot be combined with a scenario or --fawkes-dir"),
        ({"ros2cx": Path("/nowhere")}, "/nowhere: there is no such folder"),
        ({"ros2cx": Path("/")}, "this is not a checkout of ros2-clips-executive"),
        ({"spec": "nope"}, "the configuration has no spec 'nope'"),
        ({"ros2cx": None, "executors": ("move=a.py:B",)}, "--executor requires --ros2cx"),
        ({"overlay": Path("nope")}, "shipped with cxbridge: goals,"),
    ],
)
def test_invalid_options_are_refused(changes, message):
    with pytest.raises(CxbridgeError, match=re.escape(message)):
        Daemon(make_options(**changes))
