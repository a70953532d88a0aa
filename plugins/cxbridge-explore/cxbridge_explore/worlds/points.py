"""Choice points, at which the world decides the next event of a run, and choosers, which decide.

The usual option of a choice point is the event without a fault. A run reaches its choice points in the same
order each time it is played, so that the unusual choices identify the run: they are its path.
:class:`PathChooser` plays a path again, :class:`RandomChooser` draws the choices from a seed.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Protocol

from msgspec import Struct
from msgspec.structs import replace

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import CxbridgeError
from cxbridge_explore.worldmodel.distributions import Distribution, format_seconds

USUAL: Final = 0  # index of the option without a fault

# The name of an option by `make_duration_option`.
_DURATION_NAME: Final = re.compile(r"takes\(([\d.]+)\)")


class ChoiceKind(StrEnum):
    """The kinds of decisions."""

    SKILL = "skill"  # the result of a skill call
    DURATION = "duration"  # the duration of a skill
    SENSED = "sensed"  # a value of an interface
    MESSAGE = "message"  # whether a message is lost
    SKILLER = "skiller"  # a Skiller or an executor vanishes or returns
    PLANNER = "planner"  # the result of a planner call
    KILL = "kill"  # an agent of a team is killed


class Option(Struct, frozen=True):
    """An event that the world can choose.

    :param name: the name in paths, such as ``fails``; unique within its choice point.
    :param faults: the number of faults that the option uses up in an exploration.
    :param weight: the probability relative to the other options.
    :param value: the data of the option, whose type depends on the kind of choice.
    """

    name: str
    faults: int = 0
    weight: float = 1.0
    value: Any = None


def make_fault(name: str, probability: float) -> Option:
    """Return an option that uses up a fault."""
    return Option(name, faults=1, weight=probability)


def make_options(usual: str, *faults: Option) -> tuple[Option, ...]:
    """Return the usual option, which gets the remaining probability, and faults.

    :param usual: the name of the usual option.
    """
    # The sum of the probabilities may be slightly above 1 by rounding, and weights must not be negative.
    return (Option(usual, weight=max(0.0, 1 - sum(option.weight for option in faults))), *faults)


def make_duration_option(seconds: float, faults: int = 0) -> Option:
    """Return the option of a duration. The name contains the seconds, so that a path repeats the duration."""
    return Option(f"takes({format_seconds(seconds)})", faults=faults, value=seconds)


class ChoicePoint(Struct, frozen=True):
    """A moment at which the world decides.

    :param index: the number of the choice point in its run, from 0.
    :param subject: the subject of the decision, such as ``Skiller: deliver{wp='wp1'}``. Runs with equal
        earlier choices have equal subjects.
    :param seconds: the time since the start of the run, by its clock.
    :param options: the listed options, the usual option first.
    :param distribution: the distribution of a duration, which the listed options represent in an
        exploration; None for a choice about something else.
    """

    index: int
    kind: ChoiceKind
    subject: str
    seconds: float
    options: tuple[Option, ...]
    distribution: Distribution | None = None

    def without_data(self) -> ChoicePoint:
        """Return the point without the data that only the world of its run needs."""
        options = tuple(Option(option.name, option.faults) for option in self.options)
        return replace(self, options=options, distribution=None)


@dataclass(frozen=True, slots=True)
class Choice:
    """The chosen option of a choice point.

    :param option_index: the index of the option.
    """

    point: ChoicePoint
    option_index: int

    @property
    def taken_option(self) -> Option:
        """The chosen option."""
        return self.point.options[self.option_index]

    def as_dict(self) -> dict[str, Any]:
        return {
            "index": self.point.index,
            "kind": self.point.kind.value,
            "subject": self.point.subject,
            "option": self.taken_option.name,
            "seconds": round(self.point.seconds, 6),
        }


class Step(Struct, frozen=True):
    """An unusual choice in a path. The subject reveals whether the run still fits the path."""

    subject: str
    option: str


# The unusual choices of a run by the index of their point; empty for the usual run.
ChoicePath = Mapping[int, Step]


class DivergedError(CxbridgeError):
    """A path cannot be followed, since the run has other choice points."""


class Chooser(Protocol):
    """Chooses at the choice points of a run."""

    def choose(self, point: ChoicePoint) -> int | Option:
        """Return the index of the chosen option, or an option that is drawn.

        :raises DivergedError: if a path cannot be followed.
        """


def make_path(choices: Iterable[Choice]) -> ChoicePath:
    """Return the path of the unusual choices of a run."""
    return {choice.point.index: Step(choice.point.subject, choice.taken_option.name) for choice in choices}


def read_path(choices: list[dict[str, Any]]) -> ChoicePath:
    """Return the path of choices in the form of :meth:`Choice.as_dict`."""
    return {choice["index"]: Step(choice["subject"], choice["option"]) for choice in choices}


class PathChooser:
    """Follows a path.

    :param fallback_chooser: the chooser for the choice points outside of the path; None for the usual option.
    """

    def __init__(self, path: ChoicePath, fallback_chooser: Chooser | None = None) -> None:
        self._path = path
        self._fallback_chooser = fallback_chooser

    def choose(self, point: ChoicePoint) -> int | Option:
        step = self._path.get(point.index)
        if step is None:
            return USUAL if self._fallback_chooser is None else self._fallback_chooser.choose(point)
        if step.subject != point.subject:
            raise DivergedError(
                f"choice {point.index} was about {step.subject}, and is about {point.subject}",
                hint="the agent or its environment has changed since, or the agent is not deterministic",
            )
        for option_index, option in enumerate(point.options):
            if option.name == step.option:
                return option_index
        duration_match = None if point.distribution is None else _DURATION_NAME.fullmatch(step.option)
        if duration_match is not None:  # RandomChooser drew a duration that is not among the listed options
            return make_duration_option(float(duration_match[1]))
        names = ", ".join(option.name for option in point.options)
        raise DivergedError(
            f"choice {point.index}, {point.subject}, has no option '{step.option}'", hint=f"it has: {names}"
        )


class RandomChooser:
    """Draws options by their weights, and durations from their distributions.

    A draw depends on the seed, the subject, and the number of earlier choices with this subject. Therefore
    two versions of an agent meet the same world with one seed, even if they act differently in between.

    :param seed: equal seeds give equal runs.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._counts: Counter[str] = Counter()

    def choose(self, point: ChoicePoint) -> int | Option:
        subject = f"{point.kind}/{point.subject}"
        # a text as the seed, since Python derives the same state from a text in each process, unlike a hash
        rng = random.Random(f"{self._seed}/{subject}/{self._counts[subject]}")  # noqa: S311 - a simulation repeats
        self._counts[subject] += 1
        if point.distribution is not None:
            return make_duration_option(point.distribution.draw(rng))
        weights = [option.weight for option in point.options]
        drawn_index, *_ = rng.choices(range(len(weights)), weights)
        return drawn_index


class RunChoices:
    """The choices of a run so far. At each choice point, a chooser decides, and the choice is recorded.

    :param clock: the run's clock; the run starts now.
    :ivar chooser: decides at the further choice points.
    """

    def __init__(self, chooser: Chooser, clock: Clock) -> None:
        self.choices: list[Choice] = []
        self.chooser, self._clock = chooser, clock
        self._start_us = clock.now_us()

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    def choose(
        self,
        kind: ChoiceKind,
        subject: str,
        options: tuple[Option, ...],
        distribution: Distribution | None = None,
    ) -> Option:
        """Return the chosen option of a new choice point; see :class:`ChoicePoint`."""
        point = ChoicePoint(len(self.choices), kind, subject, self.seconds, options, distribution)
        decision = self.chooser.choose(point)
        # A drawn option is added to the listed options, so that a path can name the option.
        if isinstance(decision, Option):
            choice = Choice(replace(point, options=(*options, decision)), len(options))
        else:
            choice = Choice(point, decision)
        self.choices.append(choice)
        return choice.taken_option
