"""A Skiller that only waits: each skill takes the time that an estimator says, by the run's clock.

What it writes is what Fawkes' skiller-simulator writes; where that is odd, ``mode='strict'`` does better
(``docs/skiller.md`` lists the differences).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.skiller.backend import Mode, SkillerBackend
from cxbridge.skiller.control import ReaderWatch, sender_of, serial_of
from cxbridge.skiller.estimators import Estimator, Outcome, StaticEstimator
from cxbridge.skiller.skillstring import parse_skill_string
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

LOG_COMPONENT = "SkillerSimulatorExecutionThread"
"""What log lines of the simulator are under, as in Fawkes."""


class SkillerSimulator(SkillerBackend):
    """Pretends to execute skills.

    :param estimators: asked in order of descending priority; empty: one second for everything.
    :param name: id of the SkillerInterface that it writes.
    :param mode: what to do where Fawkes is odd.
    :raises BlackBoardError: when somebody else writes the interface.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        estimators: Sequence[Estimator] = (),
        *,
        name: str = "Skiller",
        mode: Mode = "strict",
    ) -> None:
        super().__init__(name)
        self.mode: Mode = mode
        self._clock = clock
        self._log = bus.logger(LOG_COMPONENT)
        self._board = board
        known = estimators or (StaticEstimator(seconds=1.0),)
        self._estimators = sorted(known, key=lambda estimator: -estimator.priority)
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing("SkillerInterface", name, owner=LOG_COMPONENT)
        self._readers = ReaderWatch(board, self._interface)
        self._outcome: Outcome | None = None
        self._end_us = 0
        self._enqueued = False
        self._handlers = {
            "AcquireControlMessage": self._acquire,
            "ReleaseControlMessage": self._release,
            "ExecSkillMessage": self._exec,
            "StopExecMessage": self._stop,
        }

    @property
    def running(self) -> bool:
        """Whether a skill is being simulated or waits for it."""
        return self._outcome is not None or not self._interface.msgq_empty()

    def loop(self) -> None:
        """Take the messages, end the skill whose time is up."""
        self._enqueued = to_write = False
        while (serial := self._readers.pop()) is not None:
            if self.mode == "strict" and serial == self._interface.exclusive_controller:
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
        if not self._enqueued and self._outcome is not None and self._clock.now_us() > self._end_us:
            self._finish(self._outcome)
            to_write = True
        if to_write:
            self._interface.write()

    def close(self) -> None:
        """Close the interface."""
        self._outcome = None
        self._readers.close()
        self._board.close(self._interface)

    # -- messages

    def _acquire(self, message: Any) -> bool:
        thread, serial = message.sender_thread_name, serial_of(message)
        controller = self._interface.exclusive_controller
        if not controller:
            self._log.debug(f"{thread} is new exclusive controller (ID {serial})")
        elif message.steal_control:
            self._log.warn(f"{thread} steals exclusive control (ID {serial})")
        elif self.mode == "strict" and controller == serial:
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
            if self.mode == "strict":  # Fawkes only says so
                self._interface.exclusive_controller = ""
                return True
        elif controller:
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
        elif self.mode == "strict":  # Fawkes' simulator executes it all the same
            self._log.warn(f"{thread} tries to exec, but other thread is controller")
            return False
        if self._outcome is not None:
            before = self._interface.skill_string
            self._log.info(f"Aborting execution of previous skill string '{before}' for new goal")
        self._interface.skill_string = text
        self._interface.msgid = message.id
        self._interface.error = ""
        self._enqueued = True
        self._begin(text)
        return True

    def _begin(self, text: str) -> None:
        try:
            self._outcome = self._estimate(text)
        except SkillError as error:  # Fawkes lets the exception fly
            self._outcome = None
            self._log.error(str(error))
            self._interface.error = error.message
            self._interface.status = Status.S_FAILED
            return
        self._interface.status = Status.S_RUNNING
        self._end_us = self._clock.now_us() + round(self._outcome.seconds * MICROSECONDS)
        self._log.info(f"Executing '{text}', will take {self._outcome.seconds:.2f} seconds")

    def _estimate(self, text: str) -> Outcome:
        """Return how a skill string ends: calls in a row run at the same time, the last one ends it."""
        outcomes = []
        for call in parse_skill_string(text):
            answers = (estimator.estimate(call) for estimator in self._estimators)
            outcome = next((answer for answer in answers if answer is not None), None)
            if outcome is None:
                raise SkillError(
                    f"no estimator knows how long '{call.name}' takes",
                    hint="give /plugins/execution-time-estimator/static/exec-time in the configuration",
                )
            outcomes.append(outcome)
        failed = [outcome for outcome in outcomes if outcome.status is not Status.S_FINAL]
        # The first failure ends a skill string.
        return (
            min(failed, key=lambda outcome: outcome.seconds)
            if failed
            else max(outcomes, key=lambda outcome: outcome.seconds)
        )

    def _stop(self, message: Any) -> bool:
        controller = self._interface.exclusive_controller
        nobody = not controller and self.mode == "strict"
        if controller != serial_of(message) and not nobody:
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
        self._log.info(f"Skill '{self._interface.skill_string}' is final")
        self._interface.error = outcome.error
        self._interface.status = outcome.status
