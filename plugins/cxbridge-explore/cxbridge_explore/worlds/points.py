"""Choice points: the moments of a run at which the world, not the agent, decides the next event."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final, Protocol

from cxbridge.errors import CxbridgeError

USUAL: Final = 0
"""The index of the default option: the event without a fault."""


class ChoiceKind(StrEnum):
    """The subject of a choice."""

    SKILL = "skill"  # how a call of a skill ends
    DURATION = "duration"
    FEEDBACK = "feedback"
    SENSED = "sensed"  # a value of an interface
    MESSAGE = "message"  # it is lost, or comes late
    SKILLER = "skiller"  # a Skiller or an executor vanishes, or comes back
    PLANNER = "planner"
    ORDER = "order"  # whose turn it is, of several agents or activations
    KILL = "kill"  # an agent of several ends without a word


@dataclass(frozen=True, slots=True)
class Option:
    """An event that the world can choose.

    :param name: its name in paths, e.g. ``fails``; unique within its choice point.
    :param faults: how many of the faults that an exploration allows it uses up.
    :param weight: its likelihood relative to the other options of the point.
    :param value: the value of the option; its type depends on the kind of choice.
    """

    name: str
    faults: int = 0
    weight: float = 1.0
    value: Any = None


class Draw(Protocol):
    """Makes options in addition to the listed ones: values of a distribution."""

    def draw(self, rng: random.Random) -> Option:
        """Return one that is drawn."""

    def read(self, name: str) -> Option | None:
        """Return the one of that name; None: it makes none of such a name."""


@dataclass(frozen=True, slots=True)
class ChoicePoint:
    """A moment at which the world decides.

    :param kind: the kind of the choice.
    :param subject: the subject in particular, e.g. ``Skiller: deliver{wp='wp1'}``. Runs with equal
        choices before have equal subjects here.
    :param seconds: the time since the start of the run, by its clock.
    :param options: at least two, or one together with ``draw``; the first is the usual one.
    :param draw: makes further options, which the listed ones represent. None: there are no further options.
    """

    kind: ChoiceKind
    subject: str
    seconds: float
    options: tuple[Option, ...]
    draw: Draw | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Choice:
    """The chosen option of a choice point.

    :param index: the number of the point in its run, from 0.
    :param point: the point.
    :param option: the index of the option.
    """

    index: int
    point: ChoicePoint
    option: int

    @property
    def taken(self) -> Option:
        """The option that was taken."""
        return self.point.options[self.option]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON can have it; :func:`read_path` takes it back."""
        return {
            "index": self.index,
            "kind": self.point.kind.value,
            "subject": self.point.subject,
            "option": self.taken.name,
            "seconds": round(self.point.seconds, 6),
        }


@dataclass(frozen=True, slots=True)
class Step:
    """A choice that a path prescribes; the subject shows whether the run is still the one it is for."""

    subject: str
    option: str


ChoicePath = Mapping[int, Step]
"""The choices of a run that are not the usual ones, by the index of their point; empty: no fault at all."""


class DivergedError(CxbridgeError):
    """A path was not followed: the run had other choice points than the one that the path was written for."""


class Chooser(Protocol):
    """Chooses at the choice points of a run."""

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the index of the option that is taken, or one that the point's ``draw`` has made.

        :param index: the number of the point in its run, from 0.
        :raises DivergedError: when a path cannot be followed.
        """


def read_path(choices: list[dict[str, Any]]) -> ChoicePath:
    """Return the path that :meth:`Choice.as_dict` wrote; usual choices are allowed and left out."""
    return {each["index"]: Step(each["subject"], each["option"]) for each in choices}


class UsualChooser:
    """Takes the usual option everywhere."""

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - all points alike
        """Return the usual one."""
        return USUAL


class PathChooser:
    """Follows a path, and lets another one choose where the path says nothing.

    :param path: the prescribed choices.
    :param then: None: the usual option.
    """

    def __init__(self, path: ChoicePath, then: Chooser | None = None) -> None:
        self._path = path
        self._then = then or UsualChooser()

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the choice of the path."""
        step = self._path.get(index)
        if step is None:
            return self._then.choose(index, point)
        if step.subject != point.subject:
            raise DivergedError(
                f"choice {index} was about {step.subject}, and is about {point.subject}",
                hint="the agent or its environment has changed since, or the agent is not deterministic",
            )
        for number, option in enumerate(point.options):
            if option.name == step.option:
                return number
        drawn = None if point.draw is None else point.draw.read(step.option)
        if drawn is not None:
            return drawn
        known = ", ".join(option.name for option in point.options)
        raise DivergedError(
            f"choice {index}, {point.subject}, has no option '{step.option}'", hint=f"it has: {known}"
        )


class RandomChooser:
    """Draws: options by their weights, durations from their distributions.

    A draw depends on the seed, on the subject of the choice, and on the number of earlier choices of the
    subject. So two versions of an agent meet the same world with one seed, even when one of them acts in
    between.

    :param seed: runs of one seed are equal.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._before: Counter[str] = Counter()

    def choose(self, index: int, point: ChoicePoint) -> int | Option:  # noqa: ARG002 - other choosers count
        """Return the drawn option."""
        subject = f"{point.kind}/{point.subject}"
        rng = random.Random(f"{self._seed}/{subject}/{self._before[subject]}")  # noqa: S311 - a simulation repeats
        self._before[subject] += 1
        if point.draw is not None:
            return point.draw.draw(rng)
        weights = [option.weight for option in point.options]
        drawn, *_ = rng.choices(range(len(weights)), weights)
        return drawn


class NotedChooser:
    """Keeps what another one chooses.

    :param chooser: who chooses.
    """

    def __init__(self, chooser: Chooser) -> None:
        self.choices: list[Choice] = []
        self._chooser = chooser

    def ask(self, point: ChoicePoint) -> Option:
        """Return the chosen option of the next point of the run."""
        index = len(self.choices)
        chosen = self._chooser.choose(index, point)
        if isinstance(chosen, Option):  # a drawn one becomes one of the point's
            point = replace(point, options=(*point.options, chosen))
            chosen = len(point.options) - 1
        choice = Choice(index, point, chosen)
        self.choices.append(choice)
        return choice.taken
