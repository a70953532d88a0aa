"""Simulated machines: workpieces on their belts, and tasks that take time on the run's clock.

The referee's rules give tasks to a machine and read its sensors: whether the machine is busy, whether a
workpiece is ready, and the number of bases in its slide. Robots put workpieces on the belt, and take them
from the belt. The referee knows the parts of a workpiece, so that a machine need not know them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock

# the durations of tasks, as in the mockup machines of the referee box, which imitate real machines
BELT_MIDDLE_S: Final = 1.538
BELT_END_S: Final = 2.656
DELIVERY_S: Final = (3.746, 4.746, 3.983)  # by the number of the gate, which counts from 1

# gets the name of a machine, the changed sensor, and its value: a truth value of `BUSY` or `READY`, or the
# number of bases of `SLIDE-COUNTER`. `BUSY`: the machine has a task; `READY`: a task has moved a workpiece to
# an end of the belt. The referee's rules wait for each change: a task ends with `BUSY` false, a machine at
# whose output a workpiece waits is free after `READY` false.
ReportSensor = Callable[[str, str, int], None]


class BeltPosition(StrEnum):
    """The positions of workpieces on the belt of a machine."""

    INPUT = "INPUT"
    MIDDLE = "MIDDLE"
    OUTPUT = "OUTPUT"


@dataclass(frozen=True, slots=True)
class Task:
    """A task of a machine. A machine does one task after another.

    :param seconds: the duration after the start.
    :param sources: the positions of which one must have a workpiece, the preferred position first; empty if
        the task needs no workpiece.
    :param target: the position of the workpiece after the task; None if no workpiece is on the belt then.
    """

    seconds: float
    sources: tuple[BeltPosition, ...] = ()
    target: BeltPosition | None = None


_INPUT, _MIDDLE, _OUTPUT = BeltPosition

# the tasks of single types of machines, with the durations of the mockup machines, too
DISPENSE: Final = Task(1.1, (), _MIDDLE)
MOUNT_RING: Final = Task(17.308, (_MIDDLE,), _MIDDLE)
HANDLE_CAP: Final = Task(17.5, (_MIDDLE,), _MIDDLE)  # mounting a cap, or taking a cap off
STORE: Final = Task(17.5, (_MIDDLE,))
RETRIEVE: Final = Task(17.5, (), _MIDDLE)
RELOCATE: Final = Task(17.5)  # moves a workpiece within the storage


class Machine:
    """A simulated machine, which executes its tasks one after another.

    :param report: gets each change of the machine's sensors.
    :ivar belt: the positions on the belt that have a workpiece.
    :ivar slide_count: the number of bases in the slide, with which robots pay for rings.
    """

    def __init__(self, name: str, clock: Clock, report: ReportSensor) -> None:
        self.name = name
        self.belt: set[BeltPosition] = set()
        self.slide_count = 0
        self._clock = clock
        self._report = report
        self._tasks: list[Task] = []
        self._due_us: int | None = None  # the end of the first task; None before its start

    # -- tasks of the referee

    def add_task(self, task: Task) -> None:
        # as the mockup machines report it: before the task starts, which may wait for a workpiece
        self._report(self.name, "BUSY", True)
        self._tasks.append(task)

    def move(self, goal: BeltPosition) -> None:
        """Move a workpiece on the belt, as soon as the belt has a workpiece."""
        # a workpiece in the middle arrives first, since the middle is close to both ends
        sources = tuple(position for position in (_MIDDLE, _INPUT, _OUTPUT) if position is not goal)
        self.add_task(Task(BELT_MIDDLE_S if goal is _MIDDLE else BELT_END_S, sources, goal))

    def deliver(self, gate: int) -> None:
        """Deliver the workpiece at the input.

        :param gate: the number of the gate, 1 to 3.
        """
        # any other number stands for one of the gates, so that it cannot end the run
        self.add_task(Task(DELIVERY_S[(gate - 1) % len(DELIVERY_S)], (_INPUT,)))

    def reset(self) -> None:
        """Stop all work, and remove the workpieces except the workpiece at the input."""
        self._tasks.clear()
        self._due_us = None
        if _OUTPUT in self.belt:
            self._report(self.name, "READY", False)
        # The rules also reset a machine that becomes idle: the next workpiece may be at its input already.
        self.belt &= {_INPUT}

    # -- methods for robots

    def put_workpiece(self) -> None:
        self.belt.add(_INPUT)

    def pay_base(self) -> None:
        self.slide_count += 1
        self._report(self.name, "SLIDE-COUNTER", self.slide_count)

    def take_workpiece(self, position: BeltPosition) -> bool:
        """Take the workpiece at a position, and return whether there was a workpiece."""
        if position not in self.belt:
            return False
        self.belt.remove(position)
        if not self.belt & {_INPUT, _OUTPUT}:
            self._report(self.name, "READY", False)
        return True

    # -- execution of tasks

    def loop(self) -> None:
        """Start and end the tasks that are due."""
        while self._tasks:
            task = self._tasks[0]
            source = next((position for position in task.sources if position in self.belt), None)
            if self._due_us is None:
                if task.sources and source is None:
                    return  # the task starts when its workpiece is on the belt
                self._due_us = self._clock.now_us() + round(task.seconds * MICROSECONDS)
            if self._clock.now_us() < self._due_us:
                return
            del self._tasks[0]
            self._due_us = None
            self.belt -= {source}  # without an effect if no source has a workpiece
            # a robot may have taken the workpiece during the task, so that no workpiece arrives
            if task.target is not None and (source is not None or not task.sources):
                self.belt.add(task.target)
                if task.target is not _MIDDLE:  # each end of the belt has a sensor
                    self._report(self.name, "READY", True)
            self._report(self.name, "BUSY", False)
