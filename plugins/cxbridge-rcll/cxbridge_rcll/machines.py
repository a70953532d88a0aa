"""Simulated machines: workpieces on their belts, and tasks that take time on the run's clock.

The referee's rules give tasks to a machine and read its sensors: whether the machine is busy, whether a
workpiece is ready, and the number of bases in its slide. Robots put workpieces on the belt, and take them
from the belt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock

# the durations of tasks, as in the mockup machines of the referee box, which imitate real machines
BELT_MIDDLE_S: Final = 1.538
BELT_END_S: Final = 2.656
DISPENSE_S: Final = 1.1
CAP_S: Final = 17.5
RING_S: Final = 17.308
STORAGE_S: Final = 17.5
DELIVERY_S: Final = (3.746, 4.746, 3.983)  # by the number of the gate, which counts from 1

# gets the name of a machine, the changed sensor (`BUSY`, `READY`, `SLIDE-COUNTER`), and its value
ReportSensor = Callable[[str, str, int], None]


class BeltPosition(StrEnum):
    """The positions of workpieces on the belt of a machine."""

    INPUT = "INPUT"
    MIDDLE = "MIDDLE"
    OUTPUT = "OUTPUT"


@dataclass(slots=True)
class Workpiece:
    """A workpiece.

    :param parts: the base, the rings and the cap, from bottom to top.
    """

    parts: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return " ".join(self.parts)


@dataclass(slots=True)
class _Task:
    """A task of a machine, which does its tasks one after another.

    :param seconds: the duration after the start.
    :param sources: the positions of which one must have a workpiece; empty if the task needs no workpiece.
    :param on_end: called at the end of the task.
    :param due_us: the time of the end; None before the start.
    """

    seconds: float
    sources: tuple[BeltPosition, ...]
    on_end: Callable[[], None]
    due_us: int | None = None


class Machine:
    """A machine.

    :param report: gets each change of the machine's sensors.
    :ivar slide_count: the number of bases in the slide, with which robots pay for rings.
    """

    def __init__(self, name: str, clock: Clock, report: ReportSensor) -> None:
        self.name = name
        self.belt: dict[BeltPosition, Workpiece] = {}
        self.slide_count = 0
        self.has_cap = False
        self.delivered_workpieces: list[Workpiece] = []
        self._clock = clock
        self._report = report
        self._tasks: list[_Task] = []

    # -- tasks of the referee

    def dispense(self, colour: str) -> None:
        """Put a base on the belt."""
        self._start_task(
            DISPENSE_S, (), lambda: self._lay_workpiece(BeltPosition.MIDDLE, Workpiece([colour]))
        )

    def move(self, goal: BeltPosition) -> None:
        """Move a workpiece on the belt, as soon as the belt has a workpiece."""
        seconds = BELT_MIDDLE_S if goal is BeltPosition.MIDDLE else BELT_END_S
        sources = tuple(position for position in BeltPosition if position is not goal)
        self._start_task(seconds, sources, lambda: self._move_workpiece(sources, goal))

    def mount_ring(self, colour: str) -> None:
        """Mount a ring on the workpiece in the middle."""
        self._start_task(
            RING_S, (BeltPosition.MIDDLE,), lambda: self.belt[BeltPosition.MIDDLE].parts.append(colour)
        )

    def retrieve_cap(self) -> None:
        """Take the cap off the workpiece in the middle."""
        self._start_task(CAP_S, (BeltPosition.MIDDLE,), self._take_cap)

    def mount_cap(self) -> None:
        """Mount the cap on the workpiece in the middle."""
        self._start_task(CAP_S, (BeltPosition.MIDDLE,), self._mount_cap)

    def deliver(self, gate: int) -> None:
        """Deliver the workpiece at the input."""
        self._start_task(
            DELIVERY_S[(gate - 1) % len(DELIVERY_S)], (BeltPosition.INPUT,), self._deliver_workpiece
        )

    def store(self) -> None:
        """Store the workpiece in the middle."""
        self._start_task(
            STORAGE_S, (BeltPosition.MIDDLE,), lambda: self._remove_workpiece(BeltPosition.MIDDLE)
        )

    def retrieve(self) -> None:
        """Retrieve a workpiece from the storage."""
        self._start_task(
            STORAGE_S, (), lambda: self._lay_workpiece(BeltPosition.MIDDLE, Workpiece(["STORED"]))
        )

    def relocate(self) -> None:
        """Relocate a workpiece within the storage."""
        self._start_task(STORAGE_S, (), lambda: None)

    def reset(self) -> None:
        """Stop all work, and remove the workpieces except the one at the input."""
        self._tasks.clear()
        self.belt.pop(BeltPosition.MIDDLE, None)
        if self.belt.pop(BeltPosition.OUTPUT, None) is not None:
            self._report(self.name, "READY", False)

    # -- methods for robots

    def has_workpiece(self, position: BeltPosition) -> bool:
        return position in self.belt

    def put_workpiece(self, workpiece: Workpiece) -> None:
        self.belt[BeltPosition.INPUT] = workpiece

    def pay_base(self) -> None:
        self.slide_count += 1
        self._report(self.name, "SLIDE-COUNTER", self.slide_count)

    def take_workpiece(self, position: BeltPosition) -> Workpiece | None:
        workpiece = self.belt.pop(position, None)
        if workpiece is not None and not self.belt.keys() & {BeltPosition.INPUT, BeltPosition.OUTPUT}:
            self._report(self.name, "READY", False)
        return workpiece

    # -- execution of tasks

    def loop(self) -> None:
        """Start and end the tasks that are due."""
        while self._tasks:
            task = self._tasks[0]
            if task.due_us is None:
                # the task starts when its workpiece is on the belt
                if task.sources and not self.belt.keys() & set(task.sources):
                    return
                task.due_us = self._clock.now_us() + round(task.seconds * MICROSECONDS)
            if self._clock.now_us() < task.due_us:
                return
            del self._tasks[0]
            task.on_end()
            self._report(self.name, "BUSY", False)

    def _start_task(
        self, seconds: float, sources: tuple[BeltPosition, ...], on_end: Callable[[], None]
    ) -> None:
        self._report(self.name, "BUSY", True)
        self._tasks.append(_Task(seconds, sources, on_end))

    def _lay_workpiece(self, position: BeltPosition, workpiece: Workpiece) -> None:
        """Lay a workpiece on the belt; a sensor at each end of the belt detects the workpiece."""
        self.belt[position] = workpiece
        if position is not BeltPosition.MIDDLE:
            self._report(self.name, "READY", True)

    def _move_workpiece(self, sources: tuple[BeltPosition, ...], goal: BeltPosition) -> None:
        # a workpiece in the middle arrives first, since it is the closest to either end
        for position in sorted(sources, key=lambda source: source is not BeltPosition.MIDDLE):
            if position in self.belt:
                self._lay_workpiece(goal, self.belt.pop(position))
                return

    def _take_cap(self) -> None:
        parts = self.belt[BeltPosition.MIDDLE].parts
        if len(parts) > 1:  # the base stays
            parts.pop()
        self.has_cap = True

    def _mount_cap(self) -> None:
        self.belt[BeltPosition.MIDDLE].parts.append(f"CAP-OF-{self.name}")
        self.has_cap = False

    def _deliver_workpiece(self) -> None:
        self.delivered_workpieces.append(self.belt[BeltPosition.INPUT])
        self._remove_workpiece(BeltPosition.INPUT)

    def _remove_workpiece(self, position: BeltPosition) -> None:
        self.belt.pop(position, None)
