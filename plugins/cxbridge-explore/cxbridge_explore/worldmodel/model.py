"""The content of a ``world.yaml``: possible events of a run and their probabilities.

The attribute ``mark`` of an entry is its place in the file, for errors. Entries with different places may be
equal, since :meth:`~cxbridge_explore.worlds.run.WorldRun.state` compares worlds by content.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from cxbridge.config.documents import Mark
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge_explore.worldmodel.distributions import Distribution

WORLD_FILE: Final = "world.yaml"

DEFAULT_PROBABILITY: Final = 0.1  # of a fault without a probability in the file


@dataclass(frozen=True, slots=True)
class SkillFailure:
    """A failure of a skill.

    :param name: the name of the failure in the path of a run.
    :param error: the error text of the skill.
    :param duration: the seconds until the failure; None for the usual duration of the skill.
    """

    name: str = "fails"
    error: str = ""
    probability: float = DEFAULT_PROBABILITY
    duration: Distribution | None = None


@dataclass(frozen=True, slots=True)
class SkillModel:
    """The possible results of skill calls.

    :param pattern: the matching calls; the name ``*`` matches all calls.
    :param duration: the duration; None for the duration in the scenario: that of the executor, a static
        estimate, or one second.
    :param hang_probability: the probability that the skill never ends.
    """

    pattern: SkillPattern
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    duration: Distribution | None = None
    hang_probability: float = 0.0
    mark: Mark = field(default=Mark(), compare=False)

    def matches(self, call: SkillStringCall) -> bool:
        """Return whether the model describes a call."""
        return self.pattern.name == "*" or self.pattern.matches(call)


@dataclass(frozen=True, slots=True)
class DecisionTimes:
    """Moments of decisions, in seconds since the start of the run.

    :param period_s: the period; 0 for a decision in each loop.
    :param begin_s: the first moment.
    :param end_s: the last moment.
    """

    period_s: float = 0.0
    begin_s: float = 0.0
    end_s: float = 10.0  # chosen freely, and documented in docs/explore.md; it bounds the exploration


@dataclass(frozen=True, slots=True)
class SensedField:
    """A field of an interface whose value the world decides.

    :param uid: the ``TYPE::ID`` of the interface, which the world writes.
    :param field_name: the name of the field.
    :param weighted_values: pairs of a value and its probability, the usual value first.
    :param times_s: the seconds of the decisions; a value stays until the next decision.
    :param skills: the names of skills whose ends also cause a decision.
    """

    uid: str
    field_name: str
    weighted_values: tuple[tuple[str, float], ...]
    times_s: tuple[float, ...] = ()
    skills: tuple[str, ...] = ()
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class MessageLoss:
    """A possible loss of messages to the writer of an interface.

    :param uid: the ``TYPE::ID`` of the interface.
    :param message_type: the type of the message; ``*`` matches all messages.
    """

    uid: str
    message_type: str = "*"
    probability: float = DEFAULT_PROBABILITY
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class Absence:
    """A possible absence of a Skiller or an executor.

    :param name: the name of the Skiller, or the id of the executor's interface.
    :param times: the moments of decisions; None for the start of each skill.
    :param return_after_s: the seconds until the return; None for no return.
    """

    name: str
    probability: float = DEFAULT_PROBABILITY
    times: DecisionTimes | None = None
    return_after_s: float | None = None
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class Kill:
    """A possible kill of an agent of a team, as by ``kill -9``.

    :param agent: the name of the agent; ``*`` matches all agents.
    :param restart_after_s: the seconds until the restart; None for no restart.
    """

    agent: str = "*"
    probability: float = DEFAULT_PROBABILITY
    times: DecisionTimes = field(default_factory=DecisionTimes)
    restart_after_s: float | None = None
    mark: Mark = field(default=Mark(), compare=False)


@dataclass(frozen=True, slots=True)
class PlannerModel:
    """The possible results of planner calls.

    :param no_plan_probability: the probability of no plan.
    :param failure_probability: the probability of a failure.
    :param delay_probability: the probability of a delayed plan.
    :param delay_s: the delay in seconds of the run's clock.
    """

    no_plan_probability: float = 0.0
    failure_probability: float = 0.0
    delay_probability: float = 0.0
    delay_s: float = 1.0


@dataclass(frozen=True, slots=True)
class WorldModel:
    """The possible events of a run.

    :param skills: the models of skill calls; the first match of a call counts.
    :param default_skill: the model of calls without a match.
    :param planner: the faults of planners; None for planners without faults.
    """

    skills: tuple[SkillModel, ...] = ()
    default_skill: SkillModel = field(default_factory=lambda: SkillModel(SkillPattern("*")))
    sensed: tuple[SensedField, ...] = ()
    message_losses: tuple[MessageLoss, ...] = ()
    absences: tuple[Absence, ...] = ()
    kills: tuple[Kill, ...] = ()
    planner: PlannerModel | None = None

    def find_skill_model(self, call: SkillStringCall) -> SkillModel:
        """Return the model of a call."""
        return next((model for model in self.skills if model.matches(call)), self.default_skill)


# The world in which each skill succeeds after its usual duration.
NOTHING_FAILS: Final = WorldModel(default_skill=SkillModel(SkillPattern("*"), failures=()))
