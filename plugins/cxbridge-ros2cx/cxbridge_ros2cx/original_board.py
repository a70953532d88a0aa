"""A skill board that treats executors as the original does, its defects included.

All executors that answer are confirmed, and all execute; none is rejected; the last confirmed one counts.
Only a master without an answer gives up, when the rules look at it. Source: SkillExecutionMaster.cpp.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.policy import BoardPolicy
from cxbridge.skiller.board.protocol import MasterState, SkillOutcome
from cxbridge.skiller.board.settings import TREE, BoardSettings
from cxbridge_ros2cx.settings import Ros2CxSettings

if TYPE_CHECKING:
    from cxbridge.config import Configuration

IDLE_S: Final = 4.0
"""Seconds that a master waits for an answer; the time-out ``start`` of such a board."""

NO_AGENT: Final = "default"
"""The skill board's name of the agent whose id is the empty string: there, names are not empty."""

_NEVER: Final = 2**63 - 1


class OriginalMaster(Master):
    """A master as the original has it."""

    __slots__ = ()

    def look(self, now_us: int) -> None:
        """Give up without an answer for more than :data:`IDLE_S`. The rules look once a tick."""
        if self.state is MasterState.ASKING and now_us > self._start_us:
            agent = "" if self.agent == NO_AGENT else self.agent
            words = [str(value) for name, value in self.call.parameters.items() if name != MAPPED_ACTION]
            self._fail(
                f"Timed out (4s) waiting for response from execution node for agent {agent}"
                f" and skill ({self.skill} {' '.join(words)})"
            )

    def responded(self, executor: str, now_us: int) -> None:  # noqa: ARG002
        """Confirm everybody; the last one is the one that counts."""
        if self.is_over:
            return
        self._sending.confirm(executor, self.number)
        self.executor = executor
        self._go(MasterState.CONFIRMED)

    def take_feedback(self, executor: str, progress: float, text: str, now_us: int) -> None:
        """Take FEEDBACK of the executor that counts, and leave the rest alone."""
        if executor == self.executor and self.has_executor:
            super().take_feedback(executor, progress, text, now_us)
            self.deadline_us = _NEVER

    def finished(self, executor: str, outcome: SkillOutcome, error: str, now_us: int, text: str = "") -> None:
        """Take FINISH of the one that counts."""
        if outcome is SkillOutcome.CANCELLED and executor == self.executor and self.has_executor:
            self._go(MasterState.CANCELLED)  # no matter who cancelled it
        else:
            super().finished(executor, outcome, error, now_us, text)

    def lost(self, executor: str) -> None:
        """Do not look whether an executor still exists."""

    def undelivered(self, executor: str, why: str) -> None:
        """Ignore whether a message was delivered."""

    def cancel(self, now_us: int) -> bool:  # noqa: ARG002
        """Send CANCEL to its executor; without an answer, nothing happens."""
        if not self.has_executor:
            return False
        self._sending.cancel(self.executor, self.number)
        self._go(MasterState.CANCELLING)
        return True

    def expire(self) -> None:
        """Time alone ends nothing: see :meth:`look`."""
        self.deadline_us = _NEVER


def policy_of(config: Configuration) -> BoardPolicy:
    """Return how the skill board of a run treats executors.

    REQUEST goes to all, as on the original's topic: the first executor that answers is confirmed, later ones
    are rejected.

    :raises ConfigError: when the settings are invalid.
    """
    if Ros2CxSettings.of(config).original:
        return BoardPolicy(
            ask_all=True, ask_later=False, answer_late=False, verbatim=True, master=OriginalMaster
        )
    return BoardPolicy(ask_all=True)


def with_idle_time(settings: BoardSettings, config: Configuration) -> BoardSettings:
    """Return settings whose masters wait for an executor as long as the original's, unless configured.

    :raises ConfigError: when the settings are invalid.
    """
    if config.exists(f"{TREE}/timeouts/start") and not Ros2CxSettings.of(config).original:
        return settings
    return replace(settings, timeouts=replace(settings.timeouts, start=IDLE_S))
