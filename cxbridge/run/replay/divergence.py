"""Divergence of a replay: a command of the executive that differs from the recorded command.

Commands of one interface are compared in their order. Times count only for a command that is overdue.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

from cxbridge.clock import MICROSECONDS

PATIENCE_US: Final = 60 * MICROSECONDS
"""The permitted delay of a command, see docs/recording.md."""


@dataclass(frozen=True, slots=True)
class Divergence:
    """A command that differs from the recorded one.

    :param uid: the interface of the Skiller or executor as ``Type::id``, or the name of a planner.
    :param number: the position among the commands of this interface or planner, from 1.
    :param expected: the recorded command; empty if there is none.
    :param actual: the command of this run; empty if there is none.
    :param elapsed_s: the time since the start of this run.
    :param recorded_elapsed_s: the time of the expected command since the start of the recorded run; None
        without an expected command.
    """

    uid: str
    number: int
    expected: str
    actual: str
    elapsed_s: float
    recorded_elapsed_s: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the divergence as JSON values."""
        return {
            "who": self.uid,
            "number": self.number,
            "expected": self.expected,
            "came": self.actual,
            "seconds": round(self.elapsed_s, 6),
            "recorded_seconds": (
                None if self.recorded_elapsed_s is None else round(self.recorded_elapsed_s, 6)
            ),
        }

    def __str__(self) -> str:
        expected, actual = self.expected or "nothing more", self.actual or "nothing"
        if self.recorded_elapsed_s is not None:
            expected += f" ({self.recorded_elapsed_s:.3f} s after the start)"
        return (
            f"{self.uid}, command number {self.number}: expected {expected}, "
            f"got {actual} ({self.elapsed_s:.3f} s after the start)"
        )


class RecordedCommand(Protocol):
    """A recorded command with its time."""

    time_us: int


R = TypeVar("R", bound=RecordedCommand)


class Expectation(Generic[R]):
    """The recorded commands of a Skiller or executor, and the position of the expected command.

    :param uid: the interface that gets the commands.
    :param commands: the recorded commands.
    :param start_us: the start of both the recorded run and this run.
    :param is_complete: whether the recording reaches the end of its run, so that any further command
        diverges.
    :param report: receives each divergence, an overdue command at each check.
    """

    def __init__(
        self,
        uid: str,
        commands: Sequence[R],
        start_us: int,
        *,
        is_complete: bool,
        report: Callable[[Divergence], None],
    ) -> None:
        self.uid = uid
        self.is_exhausted = False
        """Whether commands continued past the end of an incomplete recording."""
        self._commands, self._start_us = commands, start_us
        self._is_complete, self._report = is_complete, report
        self._position = 0  # of the expected command
        # the times of the previous command, in this run and in the recorded run
        self._last_us = self._last_recorded_us = start_us

    @property
    def expected(self) -> R | None:
        """The next recorded command; None after the last command."""
        return self._commands[self._position] if self._position < len(self._commands) else None

    def meet(self, now_us: int) -> None:
        """Advance past the expected command, which must exist: the run has given it now."""
        self._last_us, self._last_recorded_us = now_us, self._commands[self._position].time_us
        self._position += 1

    def refuse(self, actual: str, now_us: int) -> None:
        """Report a command that differs from the expected command.

        After the last command of an incomplete recording, set :attr:`is_exhausted` instead.
        """
        if self.expected is None and not self._is_complete:
            self.is_exhausted = True
        else:
            self._diverge(actual, now_us)

    def check(self, now_us: int) -> None:
        """Report an overdue command."""
        expected = self.expected
        if expected is not None:
            # counted from the previous command, so that one delay is not charged to all later commands
            due_us = self._last_us + max(0, expected.time_us - self._last_recorded_us)
            if now_us > due_us + PATIENCE_US:
                self._diverge("", now_us)

    def _diverge(self, actual: str, now_us: int) -> None:
        """Report that ``actual`` differs from the expected command."""
        expected = self.expected
        self._report(
            Divergence(
                self.uid,
                self._position + 1,
                str(expected or ""),
                actual,
                (now_us - self._start_us) / MICROSECONDS,
                None if expected is None else (expected.time_us - self._start_us) / MICROSECONDS,
            )
        )
