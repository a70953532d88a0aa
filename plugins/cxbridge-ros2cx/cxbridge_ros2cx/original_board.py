"""A skill board that treats executors like ros2-clips-executive (2021), the original, with its defects.

All executors that respond are confirmed and execute; none is rejected; the last confirmed one counts. A
master times out only without a response, when the rules check it. Source: SkillExecutionMaster.cpp.
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

# Seconds that a master waits for a response; the timeout `start` of such a board.
IDLE_S: Final = 4.0

# The skill board's name for the agent with an empty id, since the board requires names.
NO_AGENT: Final = "default"

_NEVER: Final = 2**63 - 1  # the largest 64-bit time: the deadline never passes


class OriginalMaster(Master):
    """A master with the original's behaviour."""

    __slots__ = ()

    def check_timeout(self, now_us: int) -> None:
        """Fail after :data:`IDLE_S` without a response. The rules call this once a tick."""
        if self.state is MasterState.ASKING and now_us > self._start_us:
            agent = "" if self.agent == NO_AGENT else self.agent
            words = [str(value) for name, value in self.call.parameters.items() if name != MAPPED_ACTION]
            self._fail(
                f"Timed out (4s) waiting for response from execution node for agent {agent}"
                f" and skill ({self.skill} {' '.join(words)})"
            )

    def handle_response(self, executor: str, now_us: int) -> None:  # noqa: ARG002
        """Confirm each executor; only the last one counts."""
        if self.is_over:
            return
        self._sender.confirm(executor, self.number)
        self.executor = executor
        self._enter(MasterState.CONFIRMED)

    def handle_feedback(self, executor: str, progress: float, text: str, now_us: int) -> None:
        """Process feedback of the confirmed executor only."""
        if executor == self.executor and self.has_executor:
            super().handle_feedback(executor, progress, text, now_us)
            self.deadline_us = _NEVER

    def handle_finish(
        self, executor: str, outcome: SkillOutcome, error: str, now_us: int, text: str = ""
    ) -> None:
        """Process the end that the confirmed executor reports."""
        if outcome is SkillOutcome.CANCELLED and executor == self.executor and self.has_executor:
            self._enter(MasterState.CANCELLED)  # whether or not the agent has cancelled the skill
        else:
            super().handle_finish(executor, outcome, error, now_us, text)

    def handle_loss(self, executor: str) -> None:
        """Ignore that an executor has vanished."""

    def handle_undelivered(self, executor: str, why: str) -> None:
        """Ignore failed delivery."""

    def cancel(self, now_us: int) -> bool:  # noqa: ARG002
        """Send CANCEL to the executor; do nothing if no executor has responded."""
        if not self.has_executor:
            return False
        self._sender.cancel(self.executor, self.number)
        self._enter(MasterState.CANCELLING)
        return True

    def expire(self) -> None:
        """Ignore the deadline: only :meth:`check_timeout` times out."""
        self.deadline_us = _NEVER


class TopicBoard(SkillBoard):
    """A board whose REQUEST goes to all executors, as on the original's topic.

    The first executor that responds is confirmed, later ones are rejected.
    """

    def ask(self, master: Master) -> None:
        self.ask_all(master)


class OriginalBoard(TopicBoard):
    """A board that treats executors like the original, its defects included."""

    master_class = OriginalMaster
    is_verbatim = True

    def offer(self, executor: str) -> None:
        """Ask no executor that becomes idle later."""

    def refuse_late(self, message: Any) -> None:
        """Leave late messages without an answer."""


def board_class_of(config: Configuration) -> type[SkillBoard]:
    """Return the class of a run's skill board."""
    return OriginalBoard if Ros2CxSettings.of(config).original else TopicBoard


def with_idle_time(settings: BoardSettings, config: Configuration) -> BoardSettings:
    """Return settings with the original's wait for an executor, unless configured."""
    if config.exists(f"{TREE}/timeouts/start") and not Ros2CxSettings.of(config).original:
        return settings
    return replace(settings, timeouts=replace(settings.timeouts, start=IDLE_S))
