"""Choices about skills: the result and the duration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from cxbridge.run.agent import Run
from cxbridge.skiller.simulation.deciders import FOREVER_S, Decider, Outcome
from cxbridge.skiller.simulation.estimators import STATIC_PREFIX, StaticEstimator
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status
from cxbridge.testing.scripted import ScriptedSkillers
from cxbridge.testing.skills import Call
from cxbridge_explore.worldmodel.distributions import Distribution
from cxbridge_explore.worldmodel.model import SkillFailure, SkillModel, WorldModel
from cxbridge_explore.worlds.points import (
    ChoiceKind,
    Option,
    RunChoices,
    make_duration_option,
    make_fault,
    make_options,
)

DEFAULT_DURATION_S: Final = 1.0  # duration of a skill without an estimate


class SkillResult(NamedTuple):
    """The result of a skill call.

    :param outcome: the chosen outcome; None if the skill ends as in a run without a world.
    """

    call: Call
    outcome: Outcome | None


class SkillChoices:
    """Decides the results of an agent's skills.

    :param agent: an agent that is not started yet and has no Skillers.
    :param prefix: precedes the subject of each choice, e.g. ``robot1/``.
    :param on_call: called at the start of a call with the name of the Skiller, or of the agent on the skill
        board.
    """

    def __init__(
        self, agent: Run, world: WorldModel, choices: RunChoices, prefix: str, on_call: Callable[[str], None]
    ) -> None:
        self._world, self._choices, self._prefix, self._on_call = world, choices, prefix, on_call
        # The static estimates of the scenario, if any: the durations of calls for which the world has none.
        self._usual_deciders: tuple[Decider, ...] = ()
        if agent.config.keys(STATIC_PREFIX):
            self._usual_deciders = (StaticEstimator.from_config(agent.config),)
        self.results: list[SkillResult] = []  # in the order of the calls
        self.script = ScriptedSkillers(agent, self._usual_deciders)
        self.script.otherwise.does(self._decide_result)
        agent.execution = self.script.execute  # for the calls on the skill board

    def _decide_result(self, call: Call) -> Outcome | None:
        """Decide the result of a call; None if the call ends as in a run without a world."""
        self._on_call(call.skiller)
        string_call = SkillStringCall(call.name, call.args)
        outcome = self._choose_outcome(string_call, self._make_subject(call.skiller, string_call))
        self.results.append(SkillResult(call, outcome))
        return outcome

    def _choose_outcome(self, call: SkillStringCall, subject: str) -> Outcome | None:
        model = self._world.find_skill_model(call)
        options = make_skill_options(model)
        # A call that can only succeed is not a choice point.
        usual_option, *faults = options
        option = self._choices.choose(ChoiceKind.SKILL, subject, options) if faults else usual_option
        if option.name == "hangs":
            return Outcome(FOREVER_S)
        failure: SkillFailure | None = option.value
        if failure is None:
            return None if model.duration is None else Outcome(self._choose_seconds(model.duration, subject))
        duration = failure.duration or model.duration
        seconds = (
            self._find_usual_seconds(call) if duration is None else self._choose_seconds(duration, subject)
        )
        return Outcome(seconds, Status.S_FAILED, failure.error)

    def _choose_seconds(self, duration: Distribution, subject: str) -> float:
        """Return the chosen seconds of a duration."""
        usual_value, *further_values = duration.representatives
        if not further_values:
            return usual_value
        # An unusual duration counts as a fault, which bounds the exploration.
        options = (
            make_duration_option(usual_value),
            *(make_duration_option(value, faults=1) for value in further_values),
        )
        seconds: float = self._choices.choose(ChoiceKind.DURATION, subject, options, duration).value
        return seconds

    def _find_usual_seconds(self, call: SkillStringCall) -> float:
        """Return the seconds until the failure of a call whose duration the world does not give."""
        decisions = (decider.decide(call) for decider in self._usual_deciders)
        seconds = next((outcome.seconds for outcome in decisions if outcome is not None), None)
        return DEFAULT_DURATION_S if seconds is None else seconds

    def _make_subject(self, skiller: str, call: SkillStringCall) -> str:
        arguments = ", ".join(f"{key}={value!r}" for key, value in call.args.items())
        return f"{self._prefix}{skiller}: {call.name}{{{arguments}}}"


def make_skill_options(model: SkillModel) -> tuple[Option, ...]:
    """Return the possible results of a call as options."""
    faults = [
        Option(failure.name, faults=1, weight=failure.probability, value=failure)
        for failure in model.failures
    ]
    if model.hang_probability:
        faults.append(make_fault("hangs", model.hang_probability))
    return make_options("succeeds", *faults)
