"""The possible events in the world of a run, and their probabilities: the content of a ``world.yaml``."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge_explore.worldmodel.distributions import Distribution

WORLD_FILE: Final = "world.yaml"
"""The name of the file in the scenario's folder."""

LIKELY: Final = 0.1
"""The probability of an event without a given probability."""


@dataclass(frozen=True, slots=True)
class WorldPlace:
    """Where a world is written down, for errors.

    :param file: None: in Python.
    """

    file: Path | None = None
    line: int | None = None


@dataclass(frozen=True, slots=True)
class SkillFailure:
    """A way in which a skill fails.

    :param name: what paths call it.
    :param error: the error of the skill.
    :param after: when, seconds; None: when the skill would usually be over.
    """

    name: str = "fails"
    error: str = ""
    probability: float = LIKELY
    after: Distribution | None = None


@dataclass(frozen=True, slots=True)
class SkillModel:
    """What calls of a skill can do.

    :param pattern: which calls; the name ``*`` stands for all.
    :param duration: None: as the scenario says: its executor, its static estimator, or a second.
    :param hangs: the probability that it does not end.
    :param mute: the probability that an executor of the skill board does not report its progress.
    """

    pattern: SkillPattern
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    duration: Distribution | None = None
    hangs: float = 0.0
    mute: float = 0.0
    place: WorldPlace = field(default_factory=WorldPlace, compare=False)

    def matches(self, call: SkillStringCall) -> bool:
        """Whether it is about this call."""
        return self.pattern.name == "*" or self.pattern.matches(call)


@dataclass(frozen=True, slots=True)
class Times:
    """The moments at which the world is asked, seconds since the run began.

    :param every: 0: each loop.
    :param until: the last one.
    """

    every: float = 0.0
    begin: float = 0.0
    until: float = 10.0


@dataclass(frozen=True, slots=True)
class SensedValue:
    """A field of an interface whose value the world decides.

    :param uid: ``TYPE::ID`` of the interface; the world is its writer.
    :param name: of the field.
    :param values: with their probabilities, the usual one first.
    :param at: when, seconds; the values stay until the next time.
    :param after: names of skills; it is decided when a call of one ends, too.
    """

    uid: str
    name: str
    values: tuple[tuple[str, float], ...]
    at: tuple[float, ...] = ()
    after: tuple[str, ...] = ()
    place: WorldPlace = field(default_factory=WorldPlace, compare=False)


@dataclass(frozen=True, slots=True)
class MessageFault:
    """Messages to writers of interfaces that do not arrive, or late.

    :param uid: of the interface; may have the shell's patterns.
    :param type: of the message; ``*``: all.
    :param lost: the probability that one is lost.
    :param late: the probability that one comes late.
    :param delay: how late, seconds.
    """

    uid: str
    type: str = "*"
    lost: float = 0.0
    late: float = 0.0
    delay: float = 1.0
    place: WorldPlace = field(default_factory=WorldPlace, compare=False)


@dataclass(frozen=True, slots=True)
class Absence:
    """A Skiller or an executor that may vanish.

    :param name: of the Skiller, or the id of the executor's interface.
    :param times: when; None: when a skill begins.
    :param back: after how many seconds it comes back; None: never.
    """

    name: str
    probability: float = LIKELY
    times: Times | None = None
    back: float | None = None
    place: WorldPlace = field(default_factory=WorldPlace, compare=False)


@dataclass(frozen=True, slots=True)
class Kill:
    """An agent of several that may be killed: its process ends without a word, as by ``kill -9``.

    :param agent: its name; ``*``: any.
    :param times: when.
    :param back: after how many seconds it is started again; None: never.
    """

    agent: str = "*"
    probability: float = LIKELY
    times: Times = field(default_factory=Times)
    back: float | None = None
    place: WorldPlace = field(default_factory=WorldPlace, compare=False)


@dataclass(frozen=True, slots=True)
class PlannerModel:
    """What calls of planners can do.

    :param none: the probability that there is no plan.
    :param fails: the probability that the planner fails.
    :param late: the probability that the plan comes late.
    :param delay: how late, seconds of the run's clock.
    """

    none: float = 0.0
    fails: float = 0.0
    late: float = 0.0
    delay: float = 1.0


@dataclass(frozen=True, slots=True)
class WorldModel:
    """A world.

    :param skills: the first that matches a call counts; then ``otherwise``.
    :param order: when the world decides in which order the agents take their turns; None: as configured.
    :param planner: what planners do; None: they plan.
    """

    skills: tuple[SkillModel, ...] = ()
    otherwise: SkillModel = field(default_factory=lambda: SkillModel(SkillPattern("*")))
    sensed: tuple[SensedValue, ...] = ()
    messages: tuple[MessageFault, ...] = ()
    absences: tuple[Absence, ...] = ()
    kills: tuple[Kill, ...] = ()
    order: Times | None = None
    planner: PlannerModel | None = None

    def skill(self, call: SkillStringCall) -> SkillModel:
        """Return the possible outcomes of a call."""
        return next((each for each in self.skills if each.matches(call)), self.otherwise)


NOTHING_FAILS: Final = WorldModel(otherwise=SkillModel(SkillPattern("*"), failures=()))
"""The world in which each skill succeeds after its usual time."""
