"""A run in a world that somebody chooses: what skills do is asked at choice points."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.mainloop import Hook
from cxbridge.run.assembly import Assembly
from cxbridge.run.options import RunOptions
from cxbridge.run.run import make_run
from cxbridge.skiller.simulation.estimators import Outcome
from cxbridge.skiller.status import Status
from cxbridge.testing.scripted import ScriptedSkills
from cxbridge.testing.skills import Call
from cxbridge.worlds.points import Choice, ChoiceKind, ChoicePoint, Chooser, NotedChooser, Option

_SKILL_OPTIONS: Final = (
    Option("succeeds"),
    Option("fails", faults=1, value=Outcome(1.0, Status.S_FAILED, "")),
)


@dataclass(frozen=True, slots=True)
class WorldResult:
    """How a run in a chosen world ended.

    :param is_over: whether it came to its end.
    :param seconds: of the run's clock.
    :param choices: all of them, in order.
    """

    is_over: bool
    seconds: float
    choices: tuple[Choice, ...]


class WorldRun(Closing):
    """A run whose world is asked for. A context manager; no thread is alive while a chooser is asked.

    :param options: as for ``cxbridge run``; who executes skills is not taken from them.
    :param chooser: is asked at each choice point.
    :raises CxbridgeError: when the scenario is wrong.
    """

    def __init__(self, options: RunOptions, chooser: Chooser) -> None:
        self.options = options
        self._is_started = False
        self._asked = NotedChooser(chooser)
        with ExitStack() as stack:
            self.assembly = make_run(options)
            stack.enter_context(self.assembly)
            self._start_us = self.assembly.clock.now_us()
            self._skills = [self._script(stack, agent) for agent in self.assembly.agents]
            self._stack = stack.pop_all()

    def _script(self, stack: ExitStack, agent: Assembly) -> ScriptedSkills:
        """Let the skills of an agent end as the chooser says."""
        skills = ScriptedSkills(agent.context)
        stack.callback(skills.close)
        several = len(self.assembly.agents) > 1
        skills.otherwise.does(partial(self._answer, f"{agent.name}/" if several else ""))
        self.assembly.loop.add(Hook.SKILL, skills.loop)
        return skills

    def _answer(self, agent: str, call: Call) -> Outcome | None:
        args = ", ".join(f"{key}={value!r}" for key, value in call.args.items())
        subject = f"{agent}{call.skiller}: {call.name}{{{args}}}"
        point = ChoicePoint(ChoiceKind.SKILL, subject, self.seconds, _SKILL_OPTIONS)
        outcome: Outcome | None = self._asked.ask(point).value
        return outcome

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""
        return (self.assembly.clock.now_us() - self._start_us) / MICROSECONDS

    def state(self) -> tuple[Hashable, ...] | None:
        """Return what the Skillers do next depends on, besides their interfaces; times count from now.

        None: nobody knows; executors of a skill board are programs, and nobody sees how far they are.
        """
        if any(agent.context.skill_board is not None for agent in self.assembly.agents):
            return None
        now_us = self.assembly.clock.now_us()
        return tuple(skills.state(now_us) for skills in self._skills)

    @property
    def is_over(self) -> bool:
        """Whether every root goal is over, no skill runs and the agenda is empty."""
        return self.assembly.is_over and not any(skills.running for skills in self._skills)

    def start(self) -> None:
        """Load the agents; a second call does nothing. No choice is made meanwhile."""
        if not self._is_started:
            self._is_started = True
            self.assembly.start()

    def play(self, look: Callable[[], bool] = lambda: False) -> WorldResult:
        """Run to the end, or until ``look`` is true after a loop."""
        assembly = self.assembly
        self.start()
        end_us = self._start_us + round(self.options.timeout * MICROSECONDS)

        def done() -> bool:
            return self.is_over or look() or assembly.clock.now_us() >= end_us

        assembly.loop.run(done)
        return WorldResult(self.is_over, self.seconds, tuple(self._asked.choices))

    def close(self) -> None:
        """End the run and let go of everything."""
        self._stack.close()
