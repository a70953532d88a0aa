"""The machines of the field: workpieces on their belts, and timed work on the run's clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, Protocol

from cxbridge.clock import MICROSECONDS, Clock

# seconds of machine work, from the referee box's mockup machines, which imitate real ones
BELT_MIDDLE_S: Final = 1.538
BELT_END_S: Final = 2.656
DISPENSE_S: Final = 1.1
CAP_S: Final = 17.5
RING_S: Final = 17.308
STORAGE_S: Final = 17.5
DELIVERY_S: Final = (3.746, 4.746, 3.983)

# Called with the name of a machine, what changed (`BUSY`, `READY`, `SLIDE-COUNTER`), and its value.
Report = Callable[[str, str, object], None]


class MachinePlace(StrEnum):
    """The positions of workpieces at a machine."""

    INPUT = "INPUT"
    MIDDLE = "MIDDLE"
    OUTPUT = "OUTPUT"


@dataclass(slots=True)
class Workpiece:
    """A workpiece.

    :param parts: from bottom to top: the base, rings, a cap.
    """

    parts: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return " ".join(self.parts)


class Workplace(Protocol):
    """A machine as the robots use it."""

    name: str

    def has(self, place: MachinePlace) -> bool: ...

    def put(self, workpiece: Workpiece) -> None: ...

    def pay(self) -> None:
        """Put a base into the slide as payment."""

    def take(self, place: MachinePlace) -> Workpiece | None:
        """Remove and return the workpiece at a position; None if empty."""


@dataclass(slots=True)
class _Work:
    """A task of a machine.

    :param seconds: the duration after the start.
    :param source: the positions of which one must have a workpiece; empty if none is needed.
    :param end: called at the end.
    """

    seconds: float
    source: tuple[MachinePlace, ...]
    end: Callable[[], None]
    due_us: int | None = None


class Machine:
    """A machine.

    :param report: called when its sensors change.
    """

    def __init__(self, name: str, clock: Clock, report: Report) -> None:
        self.name = name
        self.belt: dict[MachinePlace, Workpiece] = {}
        self.slide = 0
        self.has_cap = False
        self.delivered: list[Workpiece] = []
        self._clock = clock
        self._report = report
        self._work: list[_Work] = []

    # -- tasks from the referee

    def dispense(self, colour: str) -> None:
        """Put a base on the belt."""
        self._begin(DISPENSE_S, (), lambda: self._place(MachinePlace.MIDDLE, Workpiece([colour])))

    def move(self, goal: MachinePlace) -> None:
        """Move a workpiece on the belt as soon as one arrives."""
        seconds = BELT_MIDDLE_S if goal is MachinePlace.MIDDLE else BELT_END_S
        sources = tuple(place for place in MachinePlace if place is not goal)
        self._begin(seconds, sources, lambda: self._carry(sources, goal))

    def mount_ring(self, colour: str) -> None:
        """Mount a ring on the workpiece in the middle."""
        self._begin(
            RING_S, (MachinePlace.MIDDLE,), lambda: self.belt[MachinePlace.MIDDLE].parts.append(colour)
        )

    def retrieve_cap(self) -> None:
        """Take the cap off the workpiece in the middle."""
        self._begin(CAP_S, (MachinePlace.MIDDLE,), self._take_cap)

    def mount_cap(self) -> None:
        """Mount the cap on the workpiece in the middle."""
        self._begin(CAP_S, (MachinePlace.MIDDLE,), self._mount_cap)

    def deliver(self, gate: int) -> None:
        """Deliver the workpiece at the input."""
        self._begin(DELIVERY_S[(gate - 1) % len(DELIVERY_S)], (MachinePlace.INPUT,), self._deliver)

    def store(self) -> None:
        """Store the workpiece in the middle."""
        self._begin(STORAGE_S, (MachinePlace.MIDDLE,), lambda: self._discard(MachinePlace.MIDDLE))

    def retrieve(self) -> None:
        """Retrieve a workpiece from the storage."""
        self._begin(STORAGE_S, (), lambda: self._place(MachinePlace.MIDDLE, Workpiece(["STORED"])))

    def relocate(self) -> None:
        """Relocate a workpiece within the storage."""
        self._begin(STORAGE_S, (), lambda: None)

    def reset(self) -> None:
        """Stop all work and remove the workpieces behind the input."""
        self._work.clear()
        for place in (MachinePlace.MIDDLE, MachinePlace.OUTPUT):
            if self.belt.pop(place, None) is not None and place is MachinePlace.OUTPUT:
                self._report(self.name, "READY", False)

    # -- what robots do at it

    def has(self, place: MachinePlace) -> bool:
        return place in self.belt

    def put(self, workpiece: Workpiece) -> None:
        self.belt[MachinePlace.INPUT] = workpiece

    def pay(self) -> None:
        self.slide += 1
        self._report(self.name, "SLIDE-COUNTER", self.slide)

    def take(self, place: MachinePlace) -> Workpiece | None:
        taken = self.belt.pop(place, None)
        if taken is not None and not self.belt.keys() & {MachinePlace.INPUT, MachinePlace.OUTPUT}:
            self._report(self.name, "READY", False)
        return taken

    # -- its work

    def loop(self) -> None:
        """Execute due steps."""
        while self._work:
            work = self._work[0]
            if work.due_us is None:
                if work.source and not self.belt.keys() & set(work.source):
                    return
                work.due_us = self._clock.now_us() + round(work.seconds * MICROSECONDS)
            if self._clock.now_us() < work.due_us:
                return
            del self._work[0]
            work.end()
            self._report(self.name, "BUSY", False)

    def _begin(self, seconds: float, source: tuple[MachinePlace, ...], end: Callable[[], None]) -> None:
        self._report(self.name, "BUSY", True)
        self._work.append(_Work(seconds, source, end))

    def _place(self, place: MachinePlace, workpiece: Workpiece) -> None:
        self.belt[place] = workpiece
        if place is not MachinePlace.MIDDLE:
            self._report(self.name, "READY", True)

    def _carry(self, sources: tuple[MachinePlace, ...], goal: MachinePlace) -> None:
        # the workpiece closest to the middle goes first
        for place in sorted(sources, key=lambda place: place is not MachinePlace.MIDDLE):
            if place in self.belt:
                self._place(goal, self.belt.pop(place))
                return

    def _take_cap(self) -> None:
        parts = self.belt[MachinePlace.MIDDLE].parts
        if len(parts) > 1:
            parts.pop()
        self.has_cap = True

    def _mount_cap(self) -> None:
        self.belt[MachinePlace.MIDDLE].parts.append(f"CAP-OF-{self.name}")
        self.has_cap = False

    def _deliver(self) -> None:
        self.delivered.append(self.belt[MachinePlace.INPUT])
        self._discard(MachinePlace.INPUT)

    def _discard(self, place: MachinePlace) -> None:
        self.belt.pop(place, None)
