"""A Skiller without a robot: each skill waits for the duration that a decider chooses, by the run's clock.

It writes the same states as Fawkes' skiller-simulator, except for the differences listed in
``docs/evidence/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.skiller.interface import InterfaceSkiller
from cxbridge.skiller.simulation.deciders import FOREVER, Decider, Deciders, Effect, Outcome
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_string

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

LOG_COMPONENT = "SkillerSimulatorExecutionThread"
"""The simulator's log component, as in Fawkes."""


@dataclass(frozen=True, slots=True)
class _SimulatedCall:
    """A call of a skill string with its decided end."""

    skill_call: SkillStringCall
    decider: Decider
    outcome: Outcome
    seconds: float


class SkillerSimulator(InterfaceSkiller):
    """Pretends to execute skills.

    :param deciders: choose the ends of skills; empty: each skill takes a second. Closed with the simulator.
    :param name: the id of the SkillerInterface.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        deciders: Sequence[Decider] = (),
        *,
        name: str = "Skiller",
    ) -> None:
        super().__init__(board, bus, name=name, component=LOG_COMPONENT)
        self._clock = clock
        self._deciders = Deciders(deciders or (StaticEstimator(seconds=1.0),))
        self._outcome: Outcome | None = None
        self._calls: list[_SimulatedCall] = []
        self._effects: list[tuple[float, Effect]] = []
        self._start_us = self._end_us = 0

    @property
    def is_executing(self) -> bool:
        return self._outcome is not None

    def state(self, now_us: int) -> tuple[Hashable, ...]:
        """Return the state that determines the future behaviour, with relative times."""
        # a decider may ask for the state while a call starts, before the state is published
        interface = self._interface
        fields = interface.skill_string, interface.status, interface.error, bool(self._control.controller)
        if self._outcome is None:
            return self.name, fields, self._has_started_string
        times = self._start_us - now_us, self._end_us - now_us
        outcomes = tuple((simulated.skill_call.name, simulated.outcome) for simulated in self._calls)
        return self.name, fields, self._has_started_string, self._outcome, times, outcomes

    def loop(self) -> None:
        """Handle messages, and end the skill string that is due."""
        self.handle_messages()
        if self._outcome is None:
            return
        now_us = self._clock.now_us()
        self._progress(now_us)
        # a skill string runs for one loop at least, so that readers see S_RUNNING
        if not self._has_started_string and now_us > self._end_us:
            outcome_text = f"failed: {self._outcome.error}" if self._outcome.failed else "is final"
            self._log.info(f"Skill '{self.skill_string}' {outcome_text}")
            self.end(self._outcome.status, self._outcome.error)

    def close(self) -> None:
        """Close the interface and the deciders."""
        super().close()
        self._deciders.close()

    def _handle(self, message: Any) -> bool:
        is_changed = super()._handle(message)
        if is_changed and message.type in ("AcquireControlMessage", "StopExecMessage"):
            self._interface.msgid = message.id  # as in Fawkes' simulator, unlike in its Skiller
        return is_changed

    def start(self, skill_string: str) -> None:
        self._calls = [self._decide(call) for call in parse_skill_string(skill_string)]
        self._outcome, seconds = _combine_outcomes(self._calls)
        effects = [
            (simulated.seconds, simulated.outcome.then) for simulated in self._calls if simulated.outcome.then
        ]
        self._effects = sorted(effects, key=lambda effect: effect[0])
        self._start_us = self._clock.now_us()
        self._end_us = self._start_us + round(seconds * MICROSECONDS)
        duration = (
            "which does not end by itself" if seconds >= FOREVER else f"will take {seconds:.2f} seconds"
        )
        self._log.info(f"Executing '{skill_string}', {duration}")

    def _decide(self, call: SkillStringCall) -> _SimulatedCall:
        decision = self._deciders.decide(call)
        if decision is None or decision.outcome.seconds is None:
            raise SkillError(
                f"no estimator has a duration for '{call.name}'",
                hint="set /plugins/execution-time-estimator/static/exec-time in the configuration",
            )
        return _SimulatedCall(call, *decision, decision.outcome.seconds)

    def _progress(self, now_us: int) -> None:
        """Let deciders change the world, and apply the effects of ended skills."""
        seconds = (min(now_us, self._end_us) - self._start_us) / MICROSECONDS
        for simulated in self._calls:
            simulated.decider.progress(simulated.skill_call, min(seconds, simulated.seconds))
        while self._effects and self._effects[0][0] <= seconds:
            self._effects.pop(0)[1]()

    def drop(self) -> None:
        self._outcome = None


def _combine_outcomes(calls: Sequence[_SimulatedCall]) -> tuple[Outcome, float]:
    """Return the end of simultaneous calls and its time: the first failure, or the last success."""
    failures = [call for call in calls if call.outcome.failed]
    decisive_call = (min if failures else max)(failures or calls, key=lambda call: call.seconds)
    return decisive_call.outcome, decisive_call.seconds
