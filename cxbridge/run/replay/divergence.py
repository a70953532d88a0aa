"""The divergence of a replay: the executive commands something other than the recorded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

from cxbridge.clock import MICROSECONDS

PATIENCE_US: Final = 60 * MICROSECONDS
"""How late a command may be."""


@dataclass(frozen=True, slots=True)
class Divergence:
    """A command that is not the recorded one.

    :param uid: of the interface of the Skiller or executor.
    :param number: of the command there, from 1.
    :param expected: the recorded command; empty: none.
    :param came: the command of this run; empty: none.
    :param seconds: of the run's clock, since its begin.
    :param recorded_s: the time of the expected one since the start of the recorded run; None: none was
        recorded.
    """

    uid: str
    number: int
    expected: str
    came: str
    seconds: float
    recorded_s: float | None

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can have it."""
        return {
            "who": self.uid,
            "number": self.number,
            "expected": self.expected,
            "came": self.came,
            "seconds": round(self.seconds, 6),
            "recorded_seconds": None if self.recorded_s is None else round(self.recorded_s, 6),
        }

    def __str__(self) -> str:
        expected, came = self.expected or "nothing more", self.came or "nothing"
        if self.recorded_s is not None:
            expected += f" ({self.recorded_s:.3f} s after the begin)"
        return (
            f"{self.uid}, command number {self.number}: expected {expected}, "
            f"came {came} ({self.seconds:.3f} s after the begin)"
        )


class RecordedCommand(Protocol):
    """Something that was commanded at some time."""

    time_us: int


R = TypeVar("R", bound=RecordedCommand)


class Expectation(Generic[R]):
    """The recorded commands of a Skiller or an executor, in order, and the time of the next one.

    :param uid: of the interface that takes the commands.
    :param items: the recorded commands.
    :param start_us: when the recorded run, and this one, began.
    :param whole: whether the recorded run had come to its end: then nothing may follow.
    :param report: called for the first divergence.
    """

    def __init__(
        self,
        uid: str,
        items: Sequence[R],
        start_us: int,
        *,
        whole: bool,
        report: Callable[[Divergence], None],
    ) -> None:
        self.uid = uid
        self.exhausted = False
        """Whether a command came that the recording, which was cut off, does not have any more."""
        self._items = items
        self._start_us = start_us
        self._whole = whole
        self._report = report
        self._next = 0
        self._last_us = start_us
        self._last_recorded_us = start_us

    @property
    def next(self) -> R | None:
        """The expected command; None after the last one."""
        return self._items[self._next] if self._next < len(self._items) else None

    def meet(self, now_us: int) -> None:
        """Note that the next one has come."""
        self._last_us, self._last_recorded_us = now_us, self._items[self._next].time_us
        self._next += 1

    def refuse(self, came: str, now_us: int) -> None:
        """Note that something else has come."""
        expected = self.next
        if expected is None and not self._whole:
            self.exhausted = True
            return
        self._diverge(expected, came, now_us)

    def check(self, now_us: int) -> None:
        """Note when the next one is long overdue."""
        expected = self.next
        if expected is not None:
            due_us = self._last_us + max(0, expected.time_us - self._last_recorded_us)
            if now_us > due_us + PATIENCE_US:
                self._diverge(expected, "", now_us)

    def _diverge(self, expected: R | None, came: str, now_us: int) -> None:
        recorded_s = None if expected is None else (expected.time_us - self._start_us) / MICROSECONDS
        seconds = (now_us - self._start_us) / MICROSECONDS
        text = "" if expected is None else str(expected)
        self._report(Divergence(self.uid, self._next + 1, text, came, seconds, recorded_s))
