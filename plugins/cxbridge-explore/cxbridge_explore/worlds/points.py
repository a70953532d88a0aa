"""Choice points: the moments of a run at which the world decides the next event."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final, Protocol

from cxbridge.errors import CxbridgeError

USUAL: Final = 0  # index of the option without a fault


class ChoiceKind(StrEnum):
    SKILL = "skill"  # the result of a skill call
    DURATION = "duration"
    FEEDBACK = "feedback"
    SENSED = "sensed"  # a value of an interface
    MESSAGE = "message"  # lost or delayed
    SKILLER = "skiller"  # a Skiller or an executor vanishes or returns
    PLANNER = "planner"
    ORDER = "order"  # the turns of agents or activations
    KILL = "kill"  # an agent of a team is killed


@dataclass(frozen=True, slots=True)
class Option:
    """An event that the world can choose.

    :param name: the name in paths, such as ``fails``; unique within its choice point.
    :param faults: the number of faults it uses up in an exploration.
    :param weight: the probability relative to the other options.
    :param value: depends on the kind of choice.
    """

    name: str
    faults: int = 0
    weight: float = 1.0
    value: Any = None


class Draw(Protocol):
    """Makes further options of a choice point: values of a distribution."""

    def draw(self, rng: random.Random) -> Option: ...

    def read(self, name: str) -> Option | None: ...


@dataclass(frozen=True, slots=True)
class ChoicePoint:
    """A moment at which the world decides.

    :param subject: the specific subject, such as ``Skiller: deliver{wp='wp1'}``. Runs with equal choices
        before have equal subjects.
    :param seconds: since the start of the run, by its clock.
    :param options: at least two, or one with ``draw``; the usual one first.
    :param draw: makes further options, represented by the listed ones; or None.
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
    :param option: the index of the option.
    """

    index: int
    point: ChoicePoint
    option: int

    @property
    def taken(self) -> Option:
        return self.point.options[self.option]

    def as_dict(self) -> dict[str, Any]:
        return {
            "index": self.index,
            "kind": self.point.kind.value,
            "subject": self.point.subject,
            "option": self.taken.name,
            "seconds": round(self.point.seconds, 6),
        }


@dataclass(frozen=True, slots=True)
class Step:
    """A choice in a path. The subject reveals whether the run still fits the path."""

    subject: str
    option: str


# The unusual choices of a run by the index of their point; empty for the usual run.
ChoicePath = Mapping[int, Step]


class DivergedError(CxbridgeError):
    """A path was not followed: the run has other choice points."""


class Chooser(Protocol):
    """Chooses at the choice points of a run."""

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the index of the chosen option, or an option made by the point's ``draw``.

        :param index: the number of the point in its run, from 0.
        :raises DivergedError: if a path cannot be followed.
        """


def read_path(choices: list[dict[str, Any]]) -> ChoicePath:
    return {each["index"]: Step(each["subject"], each["option"]) for each in choices}


class UsualChooser:
    """Takes the usual option everywhere."""

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - the same option everywhere
        return USUAL


class PathChooser:
    """Follows a path, and asks another chooser at points outside of the path.

    :param then: the other chooser; None for the usual option.
    """

    def __init__(self, path: ChoicePath, then: Chooser | None = None) -> None:
        self._path = path
        self._then = then or UsualChooser()

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
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
    """Draws options by their weights, and durations from their distributions.

    A draw depends on the seed, the subject, and the number of earlier choices with this subject. Therefore
    two versions of an agent meet the same world with one seed, even if they act differently in between.

    :param seed: equal seeds give equal runs.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._before: Counter[str] = Counter()

    def choose(self, index: int, point: ChoicePoint) -> int | Option:  # noqa: ARG002 - subjects are counted instead
        subject = f"{point.kind}/{point.subject}"
        rng = random.Random(f"{self._seed}/{subject}/{self._before[subject]}")  # noqa: S311 - a simulation repeats
        self._before[subject] += 1
        if point.draw is not None:
            return point.draw.draw(rng)
        weights = [option.weight for option in point.options]
        drawn, *_ = rng.choices(range(len(weights)), weights)
        return drawn


class NotedChooser:
    """Records the choices of another chooser."""

    def __init__(self, chooser: Chooser) -> None:
        self.choices: list[Choice] = []
        self._chooser = chooser

    def ask(self, point: ChoicePoint) -> Option:
        """Return the option for the next point of the run."""
        index = len(self.choices)
        chosen = self._chooser.choose(index, point)
        if isinstance(chosen, Option):  # a drawn option is added to the options of the point
            point = replace(point, options=(*point.options, chosen))
            chosen = len(point.options) - 1
        choice = Choice(index, point, chosen)
        self.choices.append(choice)
        return choice.taken
