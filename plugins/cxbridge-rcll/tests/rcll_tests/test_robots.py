"""Robots: how long their skills take, their effects on machines, their failures."""

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

    def do(self, skill, **parameters):
        """Execute a skill; return how many seconds it took."""
        begun_us = self.clock.now_us()
        for _ in self.executor.execute(SkillCall(skill, "robot1", parameters)):
            self.clock.sleep_until(self.clock.now_us() + LOOP_US)
            self.machine.loop()
        return (self.clock.now_us() - begun_us) / MICROSECONDS

    def handle(self, **parameters):
        return self.do("manipulate_wp", mps="C-CS1", **parameters)


@pytest.fixture
def driver():
    return Driver()


def test_a_way_takes_as_long_as_it_is(driver):
    driver.robot.pose = Pose(0.5, 0.5)
    assert driver.do("moveto", place="C-Z15") == pytest.approx(4 / SPEED_M_PER_S + ALIGN_S, abs=0.1)
    assert driver.robot.pose[:2] == pytest.approx((0.5, 4.5))
    assert driver.do("moveto", place="nowhere") == pytest.approx(ANYWHERE_S, abs=0.1)
    assert driver.robot.pose[:2] == pytest.approx((0.5, 4.5))


def test_a_workpiece_is_taken_and_put(driver):
    driver.machine.belt.add(BeltPosition.OUTPUT)
    assert driver.handle(side="OUTPUT", target="WORKPIECE") == pytest.approx(HANDLE_S, abs=0.1)
    assert (driver.machine.belt, driver.robot.has_workpiece) == (set(), True)
    driver.handle(side="INPUT", target="CONVEYOR")
    assert (driver.machine.belt, driver.robot.has_workpiece) == ({BeltPosition.INPUT}, False)


def test_a_payment_goes_down_the_slide(driver):
    driver.handle(side="SHELF-LEFT", target="WORKPIECE")
    driver.handle(side="SLIDE", target="SLIDE")
    assert (driver.machine.slide_count, driver.robot.has_workpiece) == (1, False)
    driver.handle(side="SHELF-LEFT", target="WORKPIECE")
    driver.do("discard")
    assert not driver.robot.has_workpiece


def test_what_was_put_is_there_when_the_machine_has_moved_it(driver):
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
def test_what_cannot_be_done_fails(driver, parameters, message):
    with pytest.raises(SkillFailedError, match=message):
        driver.do("manipulate_wp", **{"mps": "C-CS1", **parameters})
