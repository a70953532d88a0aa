"""Workpieces on the belts of machines, and the reports of machines."""

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


class MachineFixture:
    """A machine with its clock and its reports."""

    def __init__(self):
        self.clock = VirtualClock()
        self.reports: list[tuple[str, object]] = []
        self.machine = Machine(
            "C-RS1", self.clock, lambda _name, signal, value: self.reports.append((signal, value))
        )

    def wait(self, seconds):
        self.clock.sleep_until(self.clock.now_us() + round(seconds * MICROSECONDS))
        self.machine.loop()

    def take_reports(self):
        reports, self.reports[:] = list(self.reports), []
        return reports


@pytest.fixture
def fixture():
    return MachineFixture()


def test_base_is_dispensed_and_moved_to_output(fixture):
    machine = fixture.machine
    machine.add_task(DISPENSE)
    machine.loop()
    fixture.wait(DISPENSE.seconds)
    assert fixture.take_reports() == [("BUSY", True), ("BUSY", False)]
    machine.move(BeltPosition.OUTPUT)
    machine.loop()
    fixture.wait(BELT_END_S / 2)
    assert machine.belt == {BeltPosition.MIDDLE}
    fixture.wait(BELT_END_S / 2)
    assert fixture.take_reports() == [("BUSY", True), ("READY", True), ("BUSY", False)]
    assert machine.take_workpiece(BeltPosition.OUTPUT)
    assert fixture.take_reports() == [("READY", False)]
    assert not machine.take_workpiece(BeltPosition.OUTPUT)


def test_belt_waits_for_workpiece(fixture):
    machine = fixture.machine
    machine.move(BeltPosition.MIDDLE)
    machine.loop()
    fixture.wait(100)
    assert fixture.take_reports() == [("BUSY", True)]
    machine.put_workpiece()
    machine.loop()
    fixture.wait(BELT_MIDDLE_S)
    assert fixture.take_reports() == [("BUSY", False)]
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
def test_task_changes_workpiece_in_middle(fixture, task, before, after):
    fixture.machine.belt = {*before, BeltPosition.INPUT}
    fixture.machine.add_task(task)
    fixture.machine.loop()
    fixture.wait(task.seconds)
    assert fixture.machine.belt == after | {BeltPosition.INPUT}
    assert fixture.take_reports() == [("BUSY", True), ("BUSY", False)]


def test_delivery_takes_workpiece_at_input(fixture):
    fixture.machine.put_workpiece()
    fixture.machine.deliver(1)
    fixture.machine.loop()
    fixture.wait(10)
    assert not fixture.machine.belt


def test_payments_are_counted(fixture):
    fixture.machine.pay_base()
    fixture.machine.pay_base()
    assert fixture.take_reports() == [("SLIDE-COUNTER", 1), ("SLIDE-COUNTER", 2)]


def test_reset_keeps_workpiece_at_input(fixture):
    machine = fixture.machine
    machine.belt = set(BeltPosition)
    machine.add_task(HANDLE_CAP)
    machine.reset()
    fixture.wait(100)
    assert machine.belt == {BeltPosition.INPUT}
    assert fixture.take_reports() == [("BUSY", True), ("READY", False)]


def test_tasks_run_in_order(fixture):
    machine = fixture.machine
    machine.add_task(DISPENSE)
    machine.move(BeltPosition.INPUT)
    machine.loop()
    fixture.wait(DISPENSE.seconds)
    fixture.wait(BELT_END_S)
    assert machine.belt == {BeltPosition.INPUT}
