"""A skill board with the behaviour of the thesis' executive, ros2-clips-executive (2021).

A master requests an executor for a skill on a topic. In the mode ``original``, with the defects of the
thesis' executive, each executor that responds is confirmed and executes the skill, and the master follows the
last confirmed executor. Only a master without a response times out, when the rules check the timeout. By
default the first executor that responds is confirmed, and the rest are rejected. Source:
SkillExecutionMaster.cpp.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import MasterState, SkillOutcome
from cxbridge.skiller.board.settings import TREE, BoardSettings
from cxbridge_ros2cx.settings import Ros2CxSettings

if TYPE_CHECKING:
    from cxbridge.config import Configuration

# the time that a master waits for a response in SkillExecutionMaster.cpp: the timeout `start` of the board
RESPONSE_TIMEOUT_S: Final = 4.0

# the skill board's name for the agent with an empty id, since the board requires names
NO_AGENT: Final = "default"

_NEVER_US: Final = 2**63 - 1  # the largest 64-bit time: such a deadline never passes


class ThesisMaster(Master):
    """A master with the defects of the thesis' executive."""

    __slots__ = ()

    def apply_timeout(self, now_us: int) -> None:
        """Fail after :data:`RESPONSE_TIMEOUT_S` without a response. The rules call this once per tick."""
        if self.state is MasterState.ASKING and now_us > self._start_deadline_us:
            agent = "" if self.agent == NO_AGENT else self.agent
            parameters = [str(value) for name, value in self.call.parameters.items() if name != MAPPED_ACTION]
            self._fail(
                f"Timed out (4s) waiting for response from execution node for agent {agent}"
                f" and skill ({self.skill} {' '.join(parameters)})"
            )

    def handle_response(self, executor: str, now_us: int) -> None:  # noqa: ARG002 - no new deadline
        """Confirm each executor, and follow the last."""
        if self.is_over:
            return
        self._sender.confirm(executor, self.number)
        self.executor = executor
        self._enter(MasterState.CONFIRMED)

    def handle_feedback(self, executor: str, progress: float, text: str, now_us: int) -> None:
        """Handle feedback of the last confirmed executor."""
        if executor == self.executor and self.has_executor:
            super().handle_feedback(executor, progress, text, now_us)
            self.deadline_us = _NEVER_US  # the base class has set a deadline for the next feedback

    def handle_finish(
        self, executor: str, outcome: SkillOutcome, error: str, now_us: int, text: str = ""
    ) -> None:
        """Handle the end that the last confirmed executor reports."""
        if outcome is SkillOutcome.CANCELLED and executor == self.executor and self.has_executor:
            # also without a cancel request of the agent, which the base class requires
            self._enter(MasterState.CANCELLED)
        else:
            super().handle_finish(executor, outcome, error, now_us, text)

    def handle_loss(self, executor: str) -> None:
        """Ignore that an executor has vanished."""

    def handle_undelivered(self, executor: str, reason: str) -> None:
        """Ignore failed delivery."""

    def cancel(self, now_us: int) -> bool:  # noqa: ARG002 - cancelling has no deadline here
        """Send CANCEL to a confirmed executor that has not finished; return whether there is one."""
        if not self.has_executor:
            return False
        self._sender.cancel(self.executor, self.number)
        self._enter(MasterState.CANCELLING)
        return True

    def expire(self) -> None:
        """Ignore the deadline: only :meth:`apply_timeout` times out."""
        self.deadline_us = _NEVER_US


class TopicBoard(SkillBoard):
    """A board whose REQUEST goes to all free executors, as on the topic of the thesis' executive.

    The first executor that responds is confirmed, and later executors are rejected.
    """

    def ask(self, master: Master) -> None:
        self.ask_all(master)


class ThesisBoard(TopicBoard):
    """A board with the defects of the thesis' executive."""

    master_class = ThesisMaster
    is_verbatim = True  # as with the thesis' executors, FEEDBACK has only what an executor yields

    def offer(self, executor: str) -> None:
        """Do nothing: an executor that becomes idle after the REQUEST is not asked."""

    def refuse_late(self, message: Any) -> None:
        """Do nothing: late messages get no answer."""


def select_board_class(config: Configuration) -> type[SkillBoard]:
    """Return the class of a run's skill board."""
    return ThesisBoard if Ros2CxSettings.from_config(config).repeats_defects else TopicBoard


def add_response_timeout(settings: BoardSettings, config: Configuration) -> BoardSettings:
    """Return settings with the response timeout of the thesis' executive, unless another is configured."""
    # the mode `original` has no configurable timeout
    if config.exists(f"{TREE}/timeouts/start") and not Ros2CxSettings.from_config(config).repeats_defects:
        return settings
    return replace(settings, timeouts=replace(settings.timeouts, start=RESPONSE_TIMEOUT_S))
