"""An executor of a skill board that has a Skiller elsewhere execute its skills."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.daemon.services.skiller_executor import TalkExecutor
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.skiller.board import ExecutorContext, SkillCall, SkillFailedError
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from tests.cli.boards import Looping
from tests.support import ROOT, ROS2CX_DIR, needs_ros2cx

OVERLAY = ROOT / "plugins" / "cxbridge-ros2cx" / "cxbridge_ros2cx" / "overlays" / "skiller.yaml"


@pytest.fixture
def robot(tmp_path):
    """The URL of a Skiller on another blackboard."""
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        estimators = [StaticEstimator(seconds=0.05)]
        simulated = Looping(lambda: SkillerSimulator(board, RealClock(), EventBus(RealClock()), estimators))
        with simulated, ZmqBlackBoardServer(board, [f"ipc://{tmp_path}/robot"]) as server:
            yield server.endpoints[0]


@pytest.fixture
def execute(robot):
    """Executes a skill string on a Skiller and returns what the executor said meanwhile."""
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        log = EventBus(RealClock()).logger("executor")

        def run(skill_string, **settings):
            context = ExecutorContext("r1", board, RealClock(), log, {"url": robot, **settings}, Path())
            executor = TalkExecutor(context)
            executor.start()
            try:
                steps = executor.execute(SkillCall("say-hello", "r1", {"mapped_action": skill_string}))
                return [said.text for said in paced(steps) if said is not None]
            finally:
                executor.close()

        yield run


def paced(steps):
    for step in steps:
        yield step
        time.sleep(0.005)


def overlay(tmp_path, url):
    file = tmp_path / "skiller.yaml"
    file.write_text(OVERLAY.read_text().replace("fawkes://localhost:1910", url))
    return file


def test_a_skill_goes_to_the_skiller_and_comes_to_its_end(execute):
    assert execute('say{text="hello"}') == ['say{text="hello"}', "completed"]


@pytest.mark.parametrize(
    ("skill_string", "skiller", "error"),
    [
        ("", "Skiller", "no skill is mapped to say-hello"),
        ("say{}", "Nobody", "no Skiller writes SkillerInterface::Nobody"),
        ("say{text=", "Skiller", "is not sent"),
        ('print("evaluated by a Fawkes")()', "Skiller", "is not sent"),
        ("say{text=1 + 1}", "Skiller", "is not sent"),
        ("say{text=os.time()}", "Skiller", "is not sent"),
    ],
)
def test_what_fails_says_why(execute, skill_string, skiller, error):
    with pytest.raises(SkillFailedError, match=error):
        execute(skill_string, skiller=skiller)


@needs_ros2cx
def test_the_planning_agent_of_the_thesis_speaks_through_a_skiller(robot, tmp_path):
    options = options_from_keywords(
        None,
        ros2cx=ROS2CX_DIR,
        spec="test-pddl",
        config=overlay(tmp_path, robot),
        clock="real",
        timeout=60,
    )
    assert run_scenario(options).status == 0


@needs_ros2cx
def test_a_virtual_clock_cannot_wait_for_a_skiller_elsewhere(tmp_path):
    options = options_from_keywords(
        None, ros2cx=ROS2CX_DIR, spec="test-pddl", config=overlay(tmp_path, "fawkes://127.0.0.1:1")
    )
    with pytest.raises(CxbridgeError, match="real clock"):
        run_scenario(options)
