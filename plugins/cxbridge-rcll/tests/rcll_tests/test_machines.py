"""Machines: the workpieces on their belts, and their reports."""

from __future__ import annotations

import pytest

from cxbridge.clock import MICROSECONDS, VirtualClock
from cxbridge_rcll.machines import (
    BELT_END_S,
    BELT_MIDDLE_S,
    DISPENSE,
    HANDLE_CAP,
    MOUNT_RING,
    RETRIEVE,
    STORE,
    BeltPosition,
    Machine,
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
    machine.add_task(DISPENSE)
    machine.loop()
    watched.wait(DISPENSE.seconds)
    assert watched.said() == [("BUSY", True), ("BUSY", False)]
    machine.move(BeltPosition.OUTPUT)
    machine.loop()
    watched.wait(BELT_END_S / 2)
    assert machine.belt == {BeltPosition.MIDDLE}
    watched.wait(BELT_END_S / 2)
    assert watched.said() == [("BUSY", True), ("READY", True), ("BUSY", False)]
    assert machine.take_workpiece(BeltPosition.OUTPUT)
    assert watched.said() == [("READY", False)]
    assert not machine.take_workpiece(BeltPosition.OUTPUT)


def test_a_belt_waits_until_something_lies_on_it(watched):
    machine = watched.machine
    machine.move(BeltPosition.MIDDLE)
    machine.loop()
    watched.wait(100)
    assert watched.said() == [("BUSY", True)]
    machine.put_workpiece()
    machine.loop()
    watched.wait(BELT_MIDDLE_S)
    assert watched.said() == [("BUSY", False)]
    assert machine.belt == {BeltPosition.MIDDLE}


@pytest.mark.parametrize(
    ("task", "before", "after"),
    [
        (MOUNT_RING, {BeltPosition.MIDDLE}, {BeltPosition.MIDDLE}),
        (HANDLE_CAP, {BeltPosition.MIDDLE}, {BeltPosition.MIDDLE}),
        (STORE, {BeltPosition.MIDDLE}, set()),
        (RETRIEVE, set(), {BeltPosition.MIDDLE}),
    ],
)
def test_a_task_leaves_or_moves_a_workpiece(watched, task, before, after):
    watched.machine.belt = {*before, BeltPosition.INPUT}
    watched.machine.add_task(task)
    watched.machine.loop()
    watched.wait(task.seconds)
    assert watched.machine.belt == after | {BeltPosition.INPUT}
    assert watched.said() == [("BUSY", True), ("BUSY", False)]


def test_a_delivery_takes_what_lies_at_the_input(watched):
    watched.machine.put_workpiece()
    watched.machine.deliver(1)
    watched.machine.loop()
    watched.wait(10)
    assert not watched.machine.belt


def test_payments_are_counted(watched):
    watched.machine.pay_base()
    watched.machine.pay_base()
    assert watched.said() == [("SLIDE-COUNTER", 1), ("SLIDE-COUNTER", 2)]


def test_a_reset_leaves_what_robots_have_put(watched):
    machine = watched.machine
    machine.belt = set(BeltPosition)
    machine.add_task(HANDLE_CAP)
    machine.reset()
    watched.wait(100)
    assert machine.belt == {BeltPosition.INPUT}
    assert watched.said() == [("BUSY", True), ("READY", False)]


def test_work_is_done_in_its_order(watched):
    machine = watched.machine
    machine.add_task(DISPENSE)
    machine.move(BeltPosition.INPUT)
    machine.loop()
    watched.wait(DISPENSE.seconds)
    watched.wait(BELT_END_S)
    assert machine.belt == {BeltPosition.INPUT}
