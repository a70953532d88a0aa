"""Durations, effects and failures of the skills of robots."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import MICROSECONDS, VirtualClock
from cxbridge.events import EventBus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.board.executor import ExecutorContext, SkillFailedError
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge_rcll.field import Field, Pose
from cxbridge_rcll.machines import BeltPosition, Machine
from cxbridge_rcll.robots import ALIGN_S, ANYWHERE_S, HANDLE_S, SPEED_M_PER_S, RobotWorld, make_robot_executor

LOOP_US = 50_000


class Driver:
    """A robot and a machine, without a run."""

    def __init__(self):
        self.clock = VirtualClock()
        bus = EventBus(self.clock)
        board = LocalBlackBoard(InterfaceRegistry(), self.clock, bus)
        self.machine = Machine("C-CS1", self.clock, lambda *_report: None)
        machines = {"C-CS1": self.machine}
        field = Field(lambda: [{"name": "C-CS1", "zone": "C_Z34", "rotation": 90}])
        self.world = RobotWorld(field, machines.get)
        self.world.add_robots(["robot1"])
        self.robot = self.world.robots["robot1"]
        kind = make_robot_executor(self.world)
        self.executor = kind(ExecutorContext("robot1", board, self.clock, bus.logger("test")))
        self.executor.start()

    def execute(self, skill, **parameters):
        """Execute a skill; return its duration in seconds."""
        begun_us = self.clock.now_us()
        for _ in self.executor.execute(SkillCall(skill, "robot1", parameters)):
            self.clock.sleep_until(self.clock.now_us() + LOOP_US)
            self.machine.loop()
        return (self.clock.now_us() - begun_us) / MICROSECONDS

    def handle(self, **parameters):
        return self.execute("manipulate_wp", mps="C-CS1", **parameters)


@pytest.fixture
def driver():
    return Driver()


def test_move_takes_time_by_distance(driver):
    driver.robot.pose = Pose(0.5, 0.5)
    assert driver.execute("moveto", place="C-Z15") == pytest.approx(4 / SPEED_M_PER_S + ALIGN_S, abs=0.1)
    assert driver.robot.pose[:2] == pytest.approx((0.5, 4.5))
    assert driver.execute("moveto", place="nowhere") == pytest.approx(ANYWHERE_S, abs=0.1)
    assert driver.robot.pose[:2] == pytest.approx((0.5, 4.5))


def test_robot_takes_and_puts_workpiece(driver):
    driver.machine.belt.add(BeltPosition.OUTPUT)
    assert driver.handle(side="OUTPUT", target="WORKPIECE") == pytest.approx(HANDLE_S, abs=0.1)
    assert (driver.machine.belt, driver.robot.has_workpiece) == (set(), True)
    driver.handle(side="INPUT", target="CONVEYOR")
    assert (driver.machine.belt, driver.robot.has_workpiece) == ({BeltPosition.INPUT}, False)


def test_payment_is_counted_at_slide(driver):
    driver.handle(side="SHELF-LEFT", target="WORKPIECE")
    driver.handle(side="SLIDE", target="SLIDE")
    assert (driver.machine.slide_count, driver.robot.has_workpiece) == (1, False)
    driver.handle(side="SHELF-LEFT", target="WORKPIECE")
    driver.execute("discard")
    assert not driver.robot.has_workpiece


def test_robot_finds_workpiece_moved_by_machine(driver):
    driver.handle(side="SHELF-LEFT", target="WORKPIECE")
    driver.machine.move(BeltPosition.MIDDLE)
    driver.handle(side="INPUT", target="CONVEYOR")
    driver.handle(dry_run=True, side="INPUT", target="WORKPIECE", query="THERE")
    assert driver.machine.belt == {BeltPosition.MIDDLE}
    driver.handle(dry_run=True, side="OUTPUT", target="WORKPIECE", query="ABSENT")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"side": "OUTPUT", "target": "WORKPIECE"}, "there is no workpiece at C-CS1 OUTPUT"),
        ({"side": "INPUT", "target": "CONVEYOR"}, "there is no workpiece in the gripper"),
        ({"dry_run": True, "side": "INPUT", "query": "THERE"}, "a workpiece is not at C-CS1 INPUT"),
        ({"mps": "C-XX"}, "there is no machine C-XX"),
    ],
)
def test_impossible_skill_fails(driver, parameters, message):
    with pytest.raises(SkillFailedError, match=message):
        driver.execute("manipulate_wp", **{"mps": "C-CS1", **parameters})
