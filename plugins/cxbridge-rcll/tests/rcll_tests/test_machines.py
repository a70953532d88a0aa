"""Machines: the workpieces on their belts, and their reports."""

from __future__ import annotations

import pytest

from cxbridge.clock import MICROSECONDS, VirtualClock
from cxbridge_rcll.machines import (
    BELT_END_S,
    BELT_MIDDLE_S,
    CAP_S,
    DISPENSE_S,
    RING_S,
    BeltPosition,
    Machine,
    Workpiece,
)


class Watched:
    """A machine, its clock, and its reports."""

    def __init__(self):
        self.clock = VirtualClock()
        self.reports: list[tuple[str, object]] = []
        self.machine = Machine(
            "C-RS1", self.clock, lambda _name, what, value: self.reports.append((what, value))
        )

    def wait(self, seconds):
        self.clock.sleep_until(self.clock.now_us() + round(seconds * MICROSECONDS))
        self.machine.loop()

    def said(self):
        said, self.reports[:] = list(self.reports), []
        return said


@pytest.fixture
def watched():
    return Watched()


def test_a_base_is_dispensed_and_moved_out(watched):
    machine = watched.machine
    machine.dispense("BASE_RED")
    machine.loop()
    watched.wait(DISPENSE_S)
    assert watched.said() == [("BUSY", True), ("BUSY", False)]
    machine.move(BeltPosition.OUTPUT)
    machine.loop()
    watched.wait(BELT_END_S / 2)
    assert BeltPosition.OUTPUT not in machine.belt
    watched.wait(BELT_END_S / 2)
    assert watched.said() == [("BUSY", True), ("READY", True), ("BUSY", False)]
    assert machine.take_workpiece(BeltPosition.OUTPUT) == Workpiece(["BASE_RED"])
    assert watched.said() == [("READY", False)]
    assert machine.take_workpiece(BeltPosition.OUTPUT) is None


def test_a_belt_waits_until_something_lies_on_it(watched):
    machine = watched.machine
    machine.move(BeltPosition.MIDDLE)
    machine.loop()
    watched.wait(100)
    assert watched.said() == [("BUSY", True)]
    machine.put_workpiece(Workpiece(["BASE_RED"]))
    machine.loop()
    watched.wait(BELT_MIDDLE_S)
    assert watched.said() == [("BUSY", False)]
    assert BeltPosition.MIDDLE in machine.belt


def test_a_ring_and_a_cap_are_mounted(watched):
    machine = watched.machine
    machine.belt[BeltPosition.MIDDLE] = Workpiece(["BASE_RED"])
    for work, seconds in ((lambda: machine.mount_ring("RING_BLUE"), RING_S), (machine.mount_cap, CAP_S)):
        work()
        machine.loop()
        watched.wait(seconds)
    assert str(machine.belt[BeltPosition.MIDDLE]) == "BASE_RED RING_BLUE CAP-OF-C-RS1"
    machine.retrieve_cap()
    machine.loop()
    watched.wait(CAP_S)
    assert str(machine.belt[BeltPosition.MIDDLE]) == "BASE_RED RING_BLUE"
    assert machine.has_cap


def test_a_delivery_takes_what_lies_at_the_input(watched):
    watched.machine.put_workpiece(Workpiece(["BASE_RED"]))
    watched.machine.deliver(1)
    watched.machine.loop()
    watched.wait(10)
    assert watched.machine.delivered_workpieces == [Workpiece(["BASE_RED"])]
    assert not watched.machine.belt


def test_payments_are_counted(watched):
    watched.machine.pay_base()
    watched.machine.pay_base()
    assert watched.said() == [("SLIDE-COUNTER", 1), ("SLIDE-COUNTER", 2)]


def test_a_reset_leaves_what_robots_have_put(watched):
    machine = watched.machine
    machine.belt = {place: Workpiece([place]) for place in BeltPosition}
    machine.mount_cap()
    machine.reset()
    watched.wait(100)
    assert list(machine.belt) == [BeltPosition.INPUT]
    assert watched.said() == [("BUSY", True), ("READY", False)]


def test_work_is_done_in_its_order(watched):
    machine = watched.machine
    machine.dispense("BASE_RED")
    machine.move(BeltPosition.INPUT)
    machine.loop()
    watched.wait(DISPENSE_S)
    watched.wait(BELT_END_S)
    assert list(machine.belt) == [BeltPosition.INPUT]
