"""Decides the events of the world of a run, at its choice points."""

from __future__ import annotations

from typing import Protocol

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge_explore.worldmodel.model import Times
from cxbridge_explore.worlds.points import ChoiceKind, ChoicePoint, Draw, NotedChooser, Option


class Ask(Protocol):
    """Decides the events of the world."""

    def __call__(
        self, kind: ChoiceKind, subject: str, options: tuple[Option, ...], draw: Draw | None = None
    ) -> Option:
        """Return the option that is taken at the next choice point.

        :param draw: makes options in addition to those.
        """


class Asking:
    """Asks a chooser, and knows how long the run lasts already.

    :param chooser: who chooses.
    """

    def __init__(self, chooser: NotedChooser, clock: Clock) -> None:
        self._chooser, self._clock = chooser, clock
        self._start_us = clock.now_us()

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    def __call__(
        self, kind: ChoiceKind, subject: str, options: tuple[Option, ...], draw: Draw | None = None
    ) -> Option:
        """Return the option that is taken at the next choice point."""
        return self._chooser.ask(ChoicePoint(kind, subject, self.seconds, options, draw))


class Schedule:
    """Knows when the world is to be asked again.

    :param times: when.
    """

    def __init__(self, times: Times) -> None:
        self._times = times
        self._next = times.begin

    def is_due(self, seconds: float) -> bool:
        """Whether it is time, at most once for each time of the schedule."""
        if not self._next <= seconds <= self._times.until:
            return False
        while self._times.every and self._next <= seconds:
            self._next += self._times.every
        return True


def fault(name: str, probability: float) -> Option:
    """Return an option that uses up a fault."""
    return Option(name, faults=1, weight=probability)


def unless(usual: str, *faults: Option) -> tuple[Option, ...]:
    """Return options: the usual one, and faults."""
    return (Option(usual, weight=max(0.0, 1 - sum(each.weight for each in faults))), *faults)
