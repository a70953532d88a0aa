"""A Skiller without a robot: each skill waits for the duration that a decider chooses, by the run's clock.

The simulator writes the same states as Fawkes' skiller-simulator, except for the differences listed in
``docs/evidence/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.skiller.interface import InterfaceSkiller
from cxbridge.skiller.simulation.deciders import FOREVER_S, Decider, Effect, Outcome, decide_outcome
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_string

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

LOG_COMPONENT = "SkillerSimulatorExecutionThread"
"""The simulator's log component, as in Fawkes."""


class SkillerSimulator(InterfaceSkiller):
    """Pretends to execute skills.

    :param deciders: choose the ends of skills; empty: each skill takes a second.
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
        self._deciders = deciders or (StaticEstimator(seconds=1.0),)
        self._outcome: Outcome | None = None
        self._skill_outcomes: list[tuple[str, Outcome]] = []  # of each call, with its skill
        # effects with their seconds from the start, the earliest first
        self._timed_effects: list[tuple[float, Effect]] = []
        self._start_us = self._end_us = 0

    @property
    def is_executing(self) -> bool:
        return self._outcome is not None

    def state(self, now_us: int) -> tuple[Hashable, ...]:
        """Return all that determines the future behaviour, with relative times, for comparison."""
        # the writer's own fields, because a decider may ask for the state while a call starts, before they
        # are published
        interface = self._interface
        fields = interface.skill_string, interface.status, interface.error, bool(self._control.controller)
        if self._outcome is None:
            return self.name, fields, self._has_started_string
        times = self._start_us - now_us, self._end_us - now_us
        return self.name, fields, self._has_started_string, self._outcome, times, tuple(self._skill_outcomes)

    def loop(self) -> None:
        """Handle messages, and end the skill string that is due."""
        self.handle_messages()
        if self._outcome is None:
            return
        now_us = self._clock.now_us()
        self._apply_effects(now_us)
        # a skill string runs for one loop at least, so that readers see S_RUNNING; as in Fawkes, it ends in
        # the first loop after its duration
        if not self._has_started_string and now_us > self._end_us:
            outcome_text = f"failed: {self._outcome.error}" if self._outcome.is_failure else "is final"
            self._log.info(f"Skill '{self.skill_string}' {outcome_text}")
            self.end(self._outcome.status, self._outcome.error)

    def _handle(self, message: Any) -> bool:
        is_changed = super()._handle(message)
        if is_changed and message.type in ("AcquireControlMessage", "StopExecMessage"):
            self._interface.msgid = message.id  # as in Fawkes' simulator, unlike in its Skiller
        return is_changed

    def start(self, skill_string: str) -> None:
        calls = parse_skill_string(skill_string)
        timed_outcomes = [self._decide(call) for call in calls]
        self._skill_outcomes = [
            (call.name, outcome) for call, (_, outcome) in zip(calls, timed_outcomes, strict=True)
        ]
        # the calls run at the same time: the first failure ends all of them, else the last success
        timed_failures = [(seconds, outcome) for seconds, outcome in timed_outcomes if outcome.is_failure]
        seconds, self._outcome = (min if timed_failures else max)(
            timed_failures or timed_outcomes, key=itemgetter(0)
        )
        timed_effects = [(effect_s, outcome.then) for effect_s, outcome in timed_outcomes if outcome.then]
        self._timed_effects = sorted(timed_effects, key=itemgetter(0))
        self._start_us = self._clock.now_us()
        self._end_us = self._start_us + round(seconds * MICROSECONDS)
        duration = (
            "which does not end by itself" if seconds >= FOREVER_S else f"will take {seconds:.2f} seconds"
        )
        self._log.info(f"Executing '{skill_string}', {duration}")

    def _decide(self, call: SkillStringCall) -> tuple[float, Outcome]:
        """Return the duration of a call in seconds, and its outcome.

        :raises SkillError: if no decider chooses a duration.
        """
        outcome = decide_outcome(self._deciders, call)
        if outcome is None or outcome.seconds is None:
            raise SkillError(
                f"no estimator has a duration for '{call.name}'",
                hint="set /plugins/execution-time-estimator/static/exec-time in the configuration",
            )
        return outcome.seconds, outcome

    def _apply_effects(self, now_us: int) -> None:
        """Apply the effects of skills that have ended, but not after the end of the skill string."""
        passed_s = (min(now_us, self._end_us) - self._start_us) / MICROSECONDS
        due_effects = [effect for effect_s, effect in self._timed_effects if effect_s <= passed_s]
        self._timed_effects = self._timed_effects[len(due_effects) :]
        for effect in due_effects:
            effect()

    def drop(self) -> None:
        self._outcome = None
