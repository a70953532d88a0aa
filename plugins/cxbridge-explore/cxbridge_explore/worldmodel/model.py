"""The content of a ``world.yaml``: possible events of a run and their probabilities.

The attribute ``mark`` of an entry is its place in the file, for errors. Entries are equal whatever their
place, since :meth:`~cxbridge_explore.worlds.run.WorldRun.state` compares worlds by content.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from cxbridge.config.documents import Mark
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge_explore.worldmodel.distributions import Distribution

WORLD_FILE: Final = "world.yaml"

DEFAULT_PROBABILITY: Final = 0.1


@dataclass(frozen=True, slots=True)
class SkillFailure:
    """A failure of a skill.

    :param name: the name of the failure in paths.
    :param error: the error text of the skill.
    :param after: the seconds until the failure; None for the usual duration of the skill.
    """

    name: str = "fails"
    error: str = ""
    probability: float = DEFAULT_PROBABILITY
    after: Distribution | None = None


@dataclass(frozen=True, slots=True)
class SkillModel:
    """The possible results of skill calls.

    :param pattern: the matching calls; the name ``*`` matches all calls.
    :param duration: the duration; None for the duration in the scenario: that of the executor, a static
        estimate, or one second.
    :param hangs: the probability that the skill never ends.
    :param mute: the probability that an executor does not report its progress.
    """

    pattern: SkillPattern
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    duration: Distribution | None = None
    hangs: float = 0.0
    mute: float = 0.0
    mark: Mark = field(default=Mark(), compare=False)

    def matches(self, call: SkillStringCall) -> bool:
        """Return whether the model describes a call."""
        return self.pattern.name == "*" or self.pattern.matches(call)


@dataclass(frozen=True, slots=True)
class Times:
    """Moments of decisions, in seconds since the start of the run.

    :param every: the period; 0 for a decision in each loop.
    :param begin: the first moment.
    :param until: the last moment.
    """

    every: float = 0.0
    begin: float = 0.0
    until: float = 10.0


@dataclass(frozen=True, slots=True)
class SensedValue:
    """A field of an interface whose value the world decides.

    :param uid: the ``TYPE::ID`` of the interface, which the world writes.
    :param name: the name of the field.
    :param values: the values with their probabilities, the usual value first.
    :param at: the seconds of the decisions; a value stays until the next decision.
    :param after: the names of skills whose ends also cause a decision.
    """

    uid: str
    name: str
    values: tuple[tuple[str, float], ...]
    at: tuple[float, ...] = ()
    after: tuple[str, ...] = ()
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class MessageFault:
    """Lost or delayed messages to writers of interfaces.

    :param uid: the ``TYPE::ID`` of the interface, which may be a shell pattern.
    :param type: the type of the message; ``*`` matches all messages.
    :param lost: the probability of a loss.
    :param late: the probability of a delay.
    :param delay: the delay in seconds.
    """

    uid: str
    type: str = "*"
    lost: float = 0.0
    late: float = 0.0
    delay: float = 1.0
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class Absence:
    """A Skiller or an executor that may vanish.

    :param name: the name of the Skiller, or the id of the executor's interface.
    :param times: the moments of decisions; None for the start of each skill.
    :param back: the seconds until the return; None for no return.
    """

    name: str
    probability: float = DEFAULT_PROBABILITY
    times: Times | None = None
    back: float | None = None
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class Kill:
    """An agent of a team that may be killed, as by ``kill -9``.

    :param agent: the name of the agent; ``*`` matches all agents.
    :param back: the seconds until the restart; None for no restart.
    """

    agent: str = "*"
    probability: float = DEFAULT_PROBABILITY
    times: Times = field(default_factory=Times)
    back: float | None = None
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class PlannerModel:
    """The possible results of planner calls.

    :param none: the probability of no plan.
    :param fails: the probability of a failure.
    :param late: the probability of a delayed plan.
    :param delay: the delay in seconds of the run's clock.
    """

    none: float = 0.0
    fails: float = 0.0
    late: float = 0.0
    delay: float = 1.0


@dataclass(frozen=True, slots=True)
class WorldModel:
    """The possible events of a run.

    :param skills: the models of skill calls; the first match of a call counts.
    :param otherwise: the model of calls without a match.
    :param order: the moments when the order of the agents' turns is decided; None for the configured order.
    :param planner: the faults of planners; None for planners without faults.
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
        """Return the model of a call."""
        return next((model for model in self.skills if model.matches(call)), self.otherwise)


# The world in which each skill succeeds after its usual duration.
NOTHING_FAILS: Final = WorldModel(otherwise=SkillModel(SkillPattern("*"), failures=()))
