"""Choices about skills: the result, the duration, and whether progress is reported."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from cxbridge.run.agent import Run
from cxbridge.skiller.board.executor import SkillExecutor, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.simulation.deciders import FOREVER, Decider, Outcome
from cxbridge.skiller.simulation.estimators import STATIC_PREFIX, StaticEstimator
from cxbridge.skiller.simulation.execution import as_string_call
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status
from cxbridge.testing.scripted import ScriptedSkills
from cxbridge.testing.skills import Call
from cxbridge_explore.worldmodel.distributions import Distribution, text_of
from cxbridge_explore.worldmodel.model import SkillFailure, SkillModel, WorldModel
from cxbridge_explore.worlds.asking import Ask, fault, unless
from cxbridge_explore.worlds.points import ChoiceKind, Option

_BEGIN, _END = "takes(", ")"


@dataclass(frozen=True, slots=True)
class DurationDraw:
    """Draws durations as options named like ``takes(3.274)``."""

    distribution: Distribution

    def draw(self, rng: random.Random) -> Option:
        return takes(self.distribution.draw(rng))

    def read(self, name: str) -> Option | None:
        if not (name.startswith(_BEGIN) and name.endswith(_END)):
            return None
        try:
            return takes(float(name[len(_BEGIN) : -len(_END)]))
        except ValueError:
            return None


class SkillAnswer(NamedTuple):
    """The result of a skill call.

    :param outcome: None for the usual result.
    """

    call: Call
    outcome: Outcome | None


def takes(seconds: float, faults: int = 0) -> Option:
    return Option(f"{_BEGIN}{text_of(seconds)}{_END}", faults=faults, value=seconds)


class SkillChoices:
    """Decides the results of an agent's skills, and asks the chooser about open choices.

    :param context: an agent without components.
    :param prefix: the prefix of its subjects.
    :param began: called with the name of the Skiller, or of the skill board's agent, that begins a call.
    """

    def __init__(
        self,
        context: Run,
        world: WorldModel,
        ask: Ask,
        prefix: str = "",
        began: Callable[[str], object] = lambda _: None,
    ) -> None:
        self._world, self._ask, self._prefix, self._on_begin = world, ask, prefix, began
        config = context.config
        self._usual: tuple[Decider, ...] = ()
        if config.keys(STATIC_PREFIX):
            self._usual = (StaticEstimator.from_config(config),)
        # The results of the calls so far, in the order of their starts.
        self.answers: list[SkillAnswer] = []
        self.script = ScriptedSkills(context, self._usual)
        self.script.otherwise.does(self._answer)
        context.execution = self._execute

    def _execute(self, executor: SkillExecutor, call: SkillCall) -> Steps:
        steps = self.script.execute(executor, call)
        string = as_string_call(call)
        mute = self._world.skill(string).mute
        if mute:
            options = unless("reports", fault("mute", mute))
            if self._ask(ChoiceKind.FEEDBACK, self._subject(call.agent, string), options).name == "mute":
                return _muted(steps)
        return steps

    def _answer(self, call: Call) -> Outcome | None:
        outcome = self._outcome(call)
        self.answers.append(SkillAnswer(call, outcome))
        return outcome

    def _outcome(self, call: Call) -> Outcome | None:
        """Decide the result of a call; None for the usual result."""
        self._on_begin(call.skiller)
        string = SkillStringCall(call.name, call.args)
        model, subject = self._world.skill(string), self._subject(call.skiller, string)
        end = self._end(model, subject)
        if end.name == "hangs":
            return Outcome(FOREVER)
        failure: SkillFailure | None = end.value
        if failure is None:
            return None if model.duration is None else Outcome(self._seconds(model.duration, subject))
        after = failure.after or model.duration
        seconds = self._usual_seconds(string) if after is None else self._seconds(after, subject)
        return Outcome(seconds, Status.S_FAILED, failure.error)

    def _end(self, model: SkillModel, subject: str) -> Option:
        options = skill_options(model)
        return self._ask(ChoiceKind.SKILL, subject, options) if len(options) > 1 else options[0]

    def _seconds(self, distribution: Distribution, subject: str) -> float:
        first, *further_values = distribution.representatives
        if not further_values:
            return first
        options = (takes(first), *(takes(each, 1) for each in further_values))
        draw = DurationDraw(distribution)
        seconds: float = self._ask(ChoiceKind.DURATION, subject, options, draw).value
        return seconds

    def _usual_seconds(self, call: SkillStringCall) -> float:
        """Return the seconds to a failure of a call without a duration in the world."""
        decisions = (decider.decide(call) for decider in self._usual)
        seconds = next((outcome.seconds for outcome in decisions if outcome is not None), None)
        return 1.0 if seconds is None else seconds

    def _subject(self, skiller: str, call: SkillStringCall) -> str:
        args = ", ".join(f"{key}={value!r}" for key, value in call.args.items())
        return f"{self._prefix}{skiller}: {call.name}{{{args}}}"


def skill_options(model: SkillModel) -> tuple[Option, ...]:
    """Return the possible results of a call, the usual one first."""
    faults = [Option(each.name, 1, each.probability, each) for each in model.failures]
    if model.hangs:
        faults.append(fault("hangs", model.hangs))
    return unless("succeeds", *faults)


def _muted(steps: Steps) -> Steps:
    """Yield the steps of a skill without their output."""
    for _ in steps:
        yield None
