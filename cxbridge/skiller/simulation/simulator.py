"""A Skiller without robot: each skill waits for the duration that a decider chooses, by the run's clock.

It writes the same states as Fawkes' skiller-simulator, except for the differences listed in
``docs/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.control import ReaderWatch, sender_of, serial_of
from cxbridge.skiller.failure import FailureCause, SkillFailure
from cxbridge.skiller.simulation.deciders import FOREVER, Decider, Deciders, Effect, Outcome
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_string
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

LOG_COMPONENT = "SkillerSimulatorExecutionThread"
"""The simulator's log component, as in Fawkes."""


@dataclass(frozen=True, slots=True)
class _Part:
    """A call of a skill string with its decided end."""

    call: SkillStringCall
    decider: Decider
    outcome: Outcome
    seconds: float


class SkillerSimulator(SkillerBackend):
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
        super().__init__(name)
        self._clock = clock
        self._log = bus.logger(LOG_COMPONENT)
        self._board = board
        self._deciders = Deciders(deciders or (StaticEstimator(seconds=1.0),))
        self._readers = ReaderWatch(board)
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=LOG_COMPONENT, listen=self._readers.listen
        )
        self._outcome: Outcome | None = None
        self._parts: list[_Part] = []
        self._effects: list[tuple[float, Effect]] = []
        self._start_us = self._end_us = 0
        self._enqueued = False
        self._handlers = {
            "AcquireControlMessage": self._acquire,
            "ReleaseControlMessage": self._release,
            "ExecSkillMessage": self._exec,
            "StopExecMessage": self._stop,
        }

    @property
    def running(self) -> bool:
        """Whether a skill is simulated or a message is pending."""
        return self._outcome is not None or not self._interface.msgq_empty()

    def state(self, now_us: int) -> tuple[Hashable, ...]:
        """Return the state that determines the future behaviour, in addition to the interface.

        Times are relative.
        """
        # deciders are called while a call starts, before the state is published
        shows = self._interface
        shown = shows.skill_string, shows.status, shows.error, bool(shows.exclusive_controller)
        if self._outcome is None:
            return self.name, shown, self._enqueued
        times = self._start_us - now_us, self._end_us - now_us
        ends = tuple((part.call.name, part.outcome) for part in self._parts)
        return self.name, shown, self._enqueued, self._outcome, times, ends

    def loop(self) -> None:
        """Handle messages, and end the skill that is due."""
        self._enqueued = to_write = False
        while (serial := self._readers.pop()) is not None:
            if serial == self._interface.exclusive_controller:
                self._log.info("Controlling interface instance was closed, revoking exclusive control")
                self._interface.exclusive_controller = ""
                to_write = True
        while (message := self._interface.msgq_first()) is not None:
            handler = self._handlers.get(message.type)
            if handler is None:
                self._log.warn("Unhandled message in skiller interface")
            else:
                to_write |= handler(message)
            self._interface.msgq_pop()
        if self._outcome is not None:
            now_us = self._clock.now_us()
            self._progress(now_us)
            if not self._enqueued and now_us > self._end_us:
                self._finish(self._outcome)
                to_write = True
        if to_write:
            self._interface.write()

    def close(self) -> None:
        """Close the interface and the deciders."""
        self._outcome = None
        self._deciders.close()
        self._readers.close()
        self._board.close(self._interface)

    def _acquire(self, message: Any) -> bool:
        thread, serial = message.sender_thread_name, serial_of(message)
        controller = self._interface.exclusive_controller
        if not controller:
            self._log.debug(f"{thread} is new exclusive controller (ID {serial})")
        elif message.steal_control:
            self._log.warn(f"{thread} steals exclusive control (ID {serial})")
        elif controller == serial:
            return False
        else:
            self._log.warn(
                f"{thread} tried to acquire exclusive control, but another controller exists already"
            )
            return False
        self._interface.exclusive_controller = serial
        self._interface.msgid = message.id
        return True

    def _release(self, message: Any) -> bool:
        thread = message.sender_thread_name
        controller = self._interface.exclusive_controller
        if controller == serial_of(message):
            self._log.debug(f"{thread} releases exclusive control")
            self._interface.exclusive_controller = ""
            return True
        if controller:
            self._log.warn(f"{thread} tried to release exclusive control, but it's not the controller")
        return False

    def _exec(self, message: Any) -> bool:
        thread, text = message.sender_thread_name, message.skill_string
        controller = self._interface.exclusive_controller
        if controller in ("", serial_of(message)):
            if self._enqueued:
                before = self._interface.skill_string
                self._log.warn(f"More than one skill string enqueued, ignoring previous string ({before}).")
            if controller:
                self._log.info(f"{thread} executes '{text}'")
            else:
                self._log.info(f"{sender_of(message)} executed '{text}' without any exclusive controller")
        else:
            self._log.warn(f"{thread} tries to exec, but other thread is controller")
            return False
        if self._outcome is not None:
            before = self._interface.skill_string
            self._log.info(f"Aborting execution of previous skill string '{before}' for new goal")
        self._interface.skill_string = text
        self._interface.msgid = message.id
        self._interface.error = ""
        self._enqueued = True
        self._start_skill(text)
        return True

    def _start_skill(self, text: str) -> None:
        try:
            self._parts = [self._decide(call) for call in parse_skill_string(text)]
        except SkillError as error:  # Fawkes does not catch this exception
            self._outcome = None
            self._log.error(str(error))
            SkillFailure.of_string(error).show(self._interface)
            return
        self._outcome, seconds = _joined(self._parts)
        effects = [(part.seconds, part.outcome.then) for part in self._parts if part.outcome.then]
        self._effects = sorted(effects, key=lambda effect: effect[0])
        self._interface.status = Status.S_RUNNING
        self._start_us = self._clock.now_us()
        self._end_us = self._start_us + round(seconds * MICROSECONDS)
        duration = (
            "which does not end by itself" if seconds >= FOREVER else f"will take {seconds:.2f} seconds"
        )
        self._log.info(f"Executing '{text}', {duration}")

    def _decide(self, call: SkillStringCall) -> _Part:
        decision = self._deciders.decide(call)
        if decision is None or decision.outcome.seconds is None:
            raise SkillError(
                f"no estimator knows how long '{call.name}' takes",
                hint="give /plugins/execution-time-estimator/static/exec-time in the configuration",
            )
        return _Part(call, *decision, decision.outcome.seconds)

    def _progress(self, now_us: int) -> None:
        """Let deciders change the world, and apply the effects of ended skills."""
        seconds = (min(now_us, self._end_us) - self._start_us) / MICROSECONDS
        for part in self._parts:
            part.decider.progress(part.call, min(seconds, part.seconds))
        while self._effects and self._effects[0][0] <= seconds:
            self._effects.pop(0)[1]()

    def _stop(self, message: Any) -> bool:
        controller = self._interface.exclusive_controller
        if controller not in ("", serial_of(message)):
            self._log.debug(f"{sender_of(message)} sent stop without any exclusive controller")
            return False
        self._log.debug(f"Stopping execution of '{self._interface.skill_string}' on request")
        self._outcome = None
        self._interface.skill_string = ""
        self._interface.error = ""
        self._interface.msgid = message.id
        self._interface.status = Status.S_INACTIVE
        return True

    def _finish(self, outcome: Outcome) -> None:
        self._outcome = None
        failure = SkillFailure(FailureCause.OUTCOME, outcome.error) if outcome.failed else None
        end = f"failed: {failure.text}" if failure else "is final"
        self._log.info(f"Skill '{self._interface.skill_string}' {end}")
        self._interface.error = outcome.error
        self._interface.status = outcome.status
        if failure is not None:
            failure.show(self._interface)


def _joined(parts: Sequence[_Part]) -> tuple[Outcome, float]:
    """Return the end of simultaneous calls: the first failure, or the last success."""
    failed = [part for part in parts if part.outcome.failed]
    last = (min if failed else max)(failed or parts, key=lambda part: part.seconds)
    return last.outcome, last.seconds
