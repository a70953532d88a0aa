"""The machines of the field: workpieces on their belts, and timed work on the run's clock.

The referee's rules order the tasks of a machine and read its sensors: whether it is busy, whether a workpiece
is ready, and the number of bases in its slide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, Protocol

from cxbridge.clock import MICROSECONDS, Clock

# The seconds of each kind of work, as in the referee box's mockup machines, which imitate real machines.
BELT_MIDDLE_S: Final = 1.538
BELT_END_S: Final = 2.656
DISPENSE_S: Final = 1.1
CAP_S: Final = 17.5
RING_S: Final = 17.308
STORAGE_S: Final = 17.5
DELIVERY_S: Final = (3.746, 4.746, 3.983)  # by gate, from 1

# Gets the name of a machine, the changed sensor (`BUSY`, `READY`, `SLIDE-COUNTER`), and its value.
Report = Callable[[str, str, int], None]


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


class Workplace(Protocol):
    """A machine as the robots use it."""

    name: str

    def has(self, position: BeltPosition) -> bool:
        """Return whether the position has a workpiece."""

    def put(self, workpiece: Workpiece) -> None:
        """Put a workpiece on the input."""

    def pay(self) -> None:
        """Put a base into the slide as payment."""

    def take(self, position: BeltPosition) -> Workpiece | None:
        """Remove and return the workpiece at a position; None if empty."""


@dataclass(slots=True)
class _Task:
    """A task of a machine, which does its tasks one after another.

    :param seconds: the duration after the start.
    :param source: the positions of which one must have a workpiece; empty if none is needed.
    :param end: called when the work is done.
    :param due_us: the time of the end; None before the start.
    """

    seconds: float
    source: tuple[BeltPosition, ...]
    end: Callable[[], None]
    due_us: int | None = None


class Machine:
    """A machine.

    :param report: gets each change of the machine's sensors.
    :ivar slide: the number of bases in the slide, the payment for rings.
    """

    def __init__(self, name: str, clock: Clock, report: Report) -> None:
        self.name = name
        self.belt: dict[BeltPosition, Workpiece] = {}
        self.slide = 0
        self.has_cap = False
        self.delivered: list[Workpiece] = []
        self._clock = clock
        self._report = report
        self._tasks: list[_Task] = []

    # -- tasks from the referee

    def dispense(self, colour: str) -> None:
        """Put a base on the belt."""
        self._start_task(DISPENSE_S, (), lambda: self._lay(BeltPosition.MIDDLE, Workpiece([colour])))

    def move(self, goal: BeltPosition) -> None:
        """Move a workpiece on the belt as soon as one arrives."""
        seconds = BELT_MIDDLE_S if goal is BeltPosition.MIDDLE else BELT_END_S
        sources = tuple(position for position in BeltPosition if position is not goal)
        self._start_task(seconds, sources, lambda: self._carry(sources, goal))

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
        self._start_task(DELIVERY_S[(gate - 1) % len(DELIVERY_S)], (BeltPosition.INPUT,), self._deliver)

    def store(self) -> None:
        """Store the workpiece in the middle."""
        self._start_task(STORAGE_S, (BeltPosition.MIDDLE,), lambda: self._discard(BeltPosition.MIDDLE))

    def retrieve(self) -> None:
        """Retrieve a workpiece from the storage."""
        self._start_task(STORAGE_S, (), lambda: self._lay(BeltPosition.MIDDLE, Workpiece(["STORED"])))

    def relocate(self) -> None:
        """Relocate a workpiece within the storage."""
        self._start_task(STORAGE_S, (), lambda: None)

    def reset(self) -> None:
        """Stop all work, and remove the workpieces except the one at the input."""
        self._tasks.clear()
        self.belt.pop(BeltPosition.MIDDLE, None)
        if self.belt.pop(BeltPosition.OUTPUT, None) is not None:
            self._report(self.name, "READY", False)

    # -- what robots do at it

    def has(self, position: BeltPosition) -> bool:
        return position in self.belt

    def put(self, workpiece: Workpiece) -> None:
        self.belt[BeltPosition.INPUT] = workpiece

    def pay(self) -> None:
        self.slide += 1
        self._report(self.name, "SLIDE-COUNTER", self.slide)

    def take(self, position: BeltPosition) -> Workpiece | None:
        workpiece = self.belt.pop(position, None)
        if workpiece is not None and not self.belt.keys() & {BeltPosition.INPUT, BeltPosition.OUTPUT}:
            self._report(self.name, "READY", False)
        return workpiece

    # -- its work

    def loop(self) -> None:
        """Start and end the due tasks."""
        while self._tasks:
            task = self._tasks[0]
            if task.due_us is None:  # a task without its workpiece waits
                if task.source and not self.belt.keys() & set(task.source):
                    return
                task.due_us = self._clock.now_us() + round(task.seconds * MICROSECONDS)
            if self._clock.now_us() < task.due_us:
                return
            del self._tasks[0]
            task.end()
            self._report(self.name, "BUSY", False)

    def _start_task(self, seconds: float, source: tuple[BeltPosition, ...], end: Callable[[], None]) -> None:
        self._report(self.name, "BUSY", True)
        self._tasks.append(_Task(seconds, source, end))

    def _lay(self, position: BeltPosition, workpiece: Workpiece) -> None:
        """Lay a workpiece on the belt; the sensors at the ends of the belt notice it."""
        self.belt[position] = workpiece
        if position is not BeltPosition.MIDDLE:
            self._report(self.name, "READY", True)

    def _carry(self, sources: tuple[BeltPosition, ...], goal: BeltPosition) -> None:
        # The workpiece in the middle is the closest to either end, and goes first.
        for position in sorted(sources, key=lambda source: source is not BeltPosition.MIDDLE):
            if position in self.belt:
                self._lay(goal, self.belt.pop(position))
                return

    def _take_cap(self) -> None:
        parts = self.belt[BeltPosition.MIDDLE].parts
        if len(parts) > 1:  # the base itself stays
            parts.pop()
        self.has_cap = True

    def _mount_cap(self) -> None:
        self.belt[BeltPosition.MIDDLE].parts.append(f"CAP-OF-{self.name}")
        self.has_cap = False

    def _deliver(self) -> None:
        self.delivered.append(self.belt[BeltPosition.INPUT])
        self._discard(BeltPosition.INPUT)

    def _discard(self, position: BeltPosition) -> None:
        self.belt.pop(position, None)
