"""Decides the events of a run at its choice points."""

from __future__ import annotations

from typing import Protocol

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge_explore.worldmodel.model import Times
from cxbridge_explore.worlds.points import ChoiceKind, ChoicePoint, Draw, NotedChooser, Option


class Ask(Protocol):
    """Decides an event."""

    def __call__(
        self, kind: ChoiceKind, subject: str, options: tuple[Option, ...], draw: Draw | None = None
    ) -> Option:
        """Return the option for the next choice point.

        :param draw: makes further options.
        """


class Asking:
    """Asks a chooser, with the time of the run."""

    def __init__(self, chooser: NotedChooser, clock: Clock) -> None:
        self._chooser, self._clock = chooser, clock
        self._start_us = clock.now_us()

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    def __call__(
        self, kind: ChoiceKind, subject: str, options: tuple[Option, ...], draw: Draw | None = None
    ) -> Option:
        return self._chooser.ask(ChoicePoint(kind, subject, self.seconds, options, draw))


class Schedule:
    """The moments of decisions."""

    def __init__(self, times: Times) -> None:
        self._times = times
        self._next = times.begin

    def is_due(self, seconds: float) -> bool:
        """Return whether a decision is due; True once for each moment."""
        if not self._next <= seconds <= self._times.until:
            return False
        while self._times.every and self._next <= seconds:
            self._next += self._times.every
        return True


def fault(name: str, probability: float) -> Option:
    """Return an option that uses up a fault."""
    return Option(name, faults=1, weight=probability)


def unless(usual: str, *faults: Option) -> tuple[Option, ...]:
    """Return a usual option and faults; the usual option gets the remaining probability."""
    return (Option(usual, weight=max(0.0, 1 - sum(each.weight for each in faults))), *faults)
