"""The master of a running action: finds an executor and follows it to the end; see docs/skill-board.md.

A master asks (ASKING) until an executor responds, confirms the executor (CONFIRMED), and runs from the
executor's first FEEDBACK (RUNNING) to its FINISH. In each of these states a deadline ends the master. A
cancelled master waits for the executor (CANCELLING), because the robot moves until then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError
from cxbridge.skiller.board.protocol import MasterState, SkillCall, SkillOutcome

if TYPE_CHECKING:
    from cxbridge.skiller.board.delivery import Sender

_NEVER_US = 2**63 - 1  # later than any time stamp
_MAX_TIMEOUT_S = 1e9  # 30 years, far within the range of clocks


@dataclass(frozen=True, slots=True)
class Timeouts:
    """Timeouts of a master in seconds.

    :param start: the limit from the request to a RESPONSE, and again from RESPONSE to the first FEEDBACK.
    :param silence: the limit between two FEEDBACK messages, and from the last one to FINISH.
    :param cancel: the limit from CANCEL to FINISH.
    """

    start: float = 5.0
    silence: float = 5.0
    cancel: float = 5.0

    def __post_init__(self) -> None:
        """Check the values.

        :raises ConfigError: if a value is not positive, or too long for clocks.
        """
        for name, seconds in asdict(self).items():
            if not 0 < seconds <= _MAX_TIMEOUT_S:
                raise ConfigError(
                    f"the timeout '{name}' of the skill board must be above 0 and at most {_MAX_TIMEOUT_S:g} "
                    "seconds"
                )


class Master:
    """One action from its request to its end, in the board's thread.

    :param sender: sends messages to executors.
    :param explain: returns why no executor has started.
    :param on_change: called after each change of state, progress or feedback.
    """

    __slots__ = (
        "_explain",
        "_on_change",
        "_sender",
        "_start_deadline_us",
        "_timeouts",
        "call",
        "deadline_us",
        "error",
        "executor",
        "feedback",
        "number",
        "parameters",
        "progress",
        "state",
    )

    def __init__(
        self,
        number: int,
        call: SkillCall,
        parameters: str,
        sender: Sender,
        timeouts: Timeouts,
        now_us: int,
        *,
        explain: Callable[[Master], str],
        on_change: Callable[[Master], None],
    ) -> None:
        self.number = number
        self.call = call
        self.parameters = parameters
        """The parameters as JSON."""
        self.state = MasterState.ASKING
        self.executor = ""
        """The confirmed executor; empty before."""
        self.progress = 0.0
        """The reported progress, 0 to 1."""
        self.feedback = ""
        """The last message of the executor."""
        self.error = ""
        """The reason for a failure, or for a cancellation that a deadline or the closing board has ended."""
        self._sender = sender
        self._timeouts = timeouts
        self._explain = explain
        self._on_change = on_change
        self._start_deadline_us = self.deadline_us = now_us + _to_us(timeouts.start)

    @property
    def skill(self) -> str:
        """The name of the skill."""
        return self.call.skill

    @property
    def agent(self) -> str:
        """The agent that executes the skill."""
        return self.call.agent

    @property
    def is_over(self) -> bool:
        """Whether the state is final."""
        return self.state.is_over

    @property
    def has_executor(self) -> bool:
        """Whether a confirmed executor has not finished yet."""
        return self.state in (MasterState.CONFIRMED, MasterState.RUNNING, MasterState.CANCELLING)

    def ask(self, executor: str) -> None:
        """Ask a suitable executor."""
        if self.state is MasterState.ASKING:
            self._sender.request(executor, self.number, self.call, self.parameters)

    def handle_response(self, executor: str, now_us: int) -> None:
        """Handle the RESPONSE of an executor of this agent."""
        if self.state is MasterState.ASKING:
            self.executor = executor
            self.deadline_us = now_us + _to_us(self._timeouts.start)
            self._enter(MasterState.CONFIRMED)
            self._sender.confirm(executor, self.number)
        # a second RESPONSE of the confirmed executor is a repetition
        elif executor != self.executor or self.is_over:
            self._sender.reject(executor, self.number)

    def handle_feedback(self, executor: str, progress: float, text: str, now_us: int) -> None:
        """Handle the FEEDBACK of an executor."""
        if executor != self.executor or not self.has_executor:
            self._sender.cancel(executor, self.number)
            return
        if self.state is MasterState.CANCELLING:
            return
        self.deadline_us = now_us + _to_us(self._timeouts.silence)
        # a repetition is a sign of life, without news for the caller
        if self.state is MasterState.RUNNING and (self.progress, self.feedback) == (progress, text):
            return
        self.progress, self.feedback = progress, text
        self._enter(MasterState.RUNNING)

    def handle_finish(
        self, executor: str, outcome: SkillOutcome, error: str, now_us: int, text: str = ""
    ) -> None:
        """Handle the FINISH of an executor.

        :param text: the executor's final message.
        """
        if executor != self.executor or not self.has_executor:
            return
        is_cancelling = self.state is MasterState.CANCELLING
        if outcome is SkillOutcome.REFUSED:
            if is_cancelling:
                self._enter(MasterState.CANCELLED)
            elif self.state is MasterState.CONFIRMED:
                self.executor = ""
                # a refusal does not extend the wait for an executor, which began with the request
                self.deadline_us = max(self._start_deadline_us, now_us)
                self._enter(MasterState.ASKING)
            else:
                self._fail(f"{executor} reports that it has never begun {self.skill}")
        elif outcome is SkillOutcome.SUCCEEDED:
            self.progress, self.feedback = 1.0, text or self.feedback
            self._enter(MasterState.SUCCEEDED)
        elif outcome is SkillOutcome.CANCELLED and is_cancelling:
            self._enter(MasterState.CANCELLED)
        else:
            verb = "stopped" if outcome is SkillOutcome.CANCELLED else "failed"
            self._fail(error or f"{executor} has {verb} {self.skill} without a reason")

    def handle_loss(self, executor: str) -> None:
        """Handle the loss of an executor."""
        if executor != self.executor or not self.has_executor:
            return
        if self.state is MasterState.CANCELLING:
            self._enter(MasterState.CANCELLED)
        else:
            self._fail(f"the executor {executor} is gone")

    def handle_undelivered(self, executor: str, reason: str) -> None:
        """Handle a CONFIRM that was probably not delivered."""
        if executor == self.executor and self.state is MasterState.CONFIRMED:
            self._sender.cancel(executor, self.number)
            self._fail(f"the executor {executor} does not accept messages: {reason}")

    def cancel(self, now_us: int) -> bool:
        """Cancel the action; return False if it is over or is being cancelled already."""
        if self.is_over or self.state is MasterState.CANCELLING:
            return False
        if self.state is MasterState.ASKING:
            self._enter(MasterState.CANCELLED)
        else:
            self.deadline_us = now_us + _to_us(self._timeouts.cancel)
            self._enter(MasterState.CANCELLING)
            self._sender.cancel(self.executor, self.number)
        return True

    def expire(self) -> None:
        """Handle the deadline :attr:`deadline_us`."""
        if self.state is MasterState.ASKING:
            self._fail(self._explain(self))
        elif self.state is MasterState.CANCELLING:
            self.error = f"{self.executor} did not answer CANCEL"
            self._enter(MasterState.CANCELLED)
        elif self.has_executor:
            has_begun = self.state is MasterState.RUNNING
            seconds = self._timeouts.silence if has_begun else self._timeouts.start
            failure = "was silent" if has_begun else "did not begin"
            self._sender.cancel(self.executor, self.number)
            self._fail(f"the executor {self.executor} {failure} for {seconds:g} s")

    def give_up(self, reason: str) -> None:
        """Become CANCELLED without an answer of the executor, because the board closes."""
        if not self.is_over:
            self.error = reason
            self._enter(MasterState.CANCELLED)

    def _fail(self, error: str) -> None:
        self.error = error
        self._enter(MasterState.FAILED)

    def _enter(self, state: MasterState) -> None:
        """Change the state, and notify the board."""
        self.state = state
        if state.is_over:
            self.deadline_us = _NEVER_US
        self._on_change(self)


def _to_us(seconds: float) -> int:
    return round(seconds * MICROSECONDS)
