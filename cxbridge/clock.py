"""Clocks: real, scaled or virtual.

Times are integers, in microseconds since the epoch (1970-01-01 UTC). They are as exact as Fawkes' ``(seconds,
microseconds)`` pairs and cheap to compare.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from contextlib import suppress
from functools import cached_property

from cxbridge.errors import ConfigError

MICROSECONDS = 1_000_000
"""The number of microseconds in a second."""

_MAX_US = 2**63 - 1  # the largest signed integer of 64 bits
_MIN_ASCTIME_S = 1_000_000_000  # Fawkes prints an earlier time as two numbers

MIN_FACTOR, MAX_FACTOR = 1e-6, 1e6
"""The limits of a scaled clock's factor."""

VIRTUAL_EPOCH_US = 1_000_000_000 * MICROSECONDS
"""The start of a virtual clock, 2001-09-09 01:46:40 UTC, fixed to make runs reproducible."""


def split_us(time_us: int) -> tuple[int, int]:
    """Split microseconds since the epoch into Fawkes' ``(seconds, microseconds)``."""
    return divmod(time_us, MICROSECONDS)


def join_us(seconds: int, microseconds: int) -> int:
    """Join Fawkes' ``(seconds, microseconds)`` to microseconds, limited to a signed 64-bit integer."""
    # a writer may stamp an interface with any two numbers, and readers must not fail to pass them on
    return max(-_MAX_US, min(seconds * MICROSECONDS + microseconds, _MAX_US))


def format_asctime(time_us: int) -> str:
    """Return a time as Fawkes prints it: in the machine's time zone, before 2001-09-09 as two numbers."""
    seconds, microseconds = split_us(time_us)
    if seconds >= _MIN_ASCTIME_S:
        with suppress(OverflowError, ValueError, OSError):  # a year beyond the range of the C library
            return time.asctime(time.localtime(seconds))
    return f"{seconds}:{microseconds}"


class Clock(ABC):
    """A source of time that can also wait for a time."""

    name: str
    """The name on the command line: ``virtual``, ``real``, ``scaled:N`` or ``ros2``."""

    @abstractmethod
    def now_us(self) -> int:
        """Return the time in microseconds since the epoch."""

    @cached_property
    def start_us(self) -> int:
        """The time of the first access, from which seconds of the run are counted."""
        return self.now_us()

    @abstractmethod
    def sleep_until(self, time_us: int, wake: threading.Event | None = None) -> None:
        """Wait until :meth:`now_us` reaches ``time_us``.

        :param wake: ends the wait early when it is set.
        """

    @property
    def is_virtual(self) -> bool:
        """Whether time passes only in :meth:`sleep_until`."""
        return False

    def close(self) -> None:  # noqa: B027 - most clocks hold no resources
        """Release the clock's resources."""


class RealClock(Clock):
    """The wall clock at the start plus the scaled time since then by the monotonic clock; never decreases.

    :param factor: seconds of the clock per second since the start.
    :raises ConfigError: if the factor is out of range.
    """

    def __init__(self, factor: float = 1.0) -> None:
        if not MIN_FACTOR <= factor <= MAX_FACTOR:
            raise ConfigError(
                f"a clock cannot run at {factor:g} times real time",
                hint=f"use a factor from {MIN_FACTOR:g} to {MAX_FACTOR:g}",
            )
        self.name = "real" if factor == 1.0 else f"scaled:{factor:g}"
        self._factor = factor
        self._start_wall_us = time.time_ns() // 1000
        self._start_monotonic_ns = time.monotonic_ns()

    def now_us(self) -> int:
        elapsed_us = (time.monotonic_ns() - self._start_monotonic_ns) // 1000
        return self._start_wall_us + int(elapsed_us * self._factor)

    def sleep_until(self, time_us: int, wake: threading.Event | None = None) -> None:
        seconds = (time_us - self.now_us()) / self._factor / MICROSECONDS
        if seconds > 0:
            # a longer wait raises OverflowError
            (wake or threading.Event()).wait(min(seconds, threading.TIMEOUT_MAX))


class VirtualClock(Clock):
    """Time that passes only while sleeping, which makes runs reproducible and fast."""

    name = "virtual"

    def __init__(self, start_us: int = VIRTUAL_EPOCH_US) -> None:
        self._now_us = start_us

    def now_us(self) -> int:
        return self._now_us

    def sleep_until(self, time_us: int, wake: threading.Event | None = None) -> None:  # noqa: ARG002
        """Advance the clock to ``time_us``, but never backwards."""
        self._now_us = max(self._now_us, time_us)

    @property
    def is_virtual(self) -> bool:
        return True


def make_clock(name: str) -> Clock:
    """Return a clock by its name on the command line: ``virtual``, ``real`` or ``scaled:N``.

    :raises ConfigError: if the name is unknown, or the factor is out of range.
    """
    if name == "virtual":
        return VirtualClock()
    if name == "real":
        return RealClock()
    kind, _, factor = name.partition(":")
    if kind == "scaled":
        with suppress(ValueError):
            return RealClock(float(factor))
    raise ConfigError(f"unknown clock '{name}'", hint="use virtual, real, or scaled:N (e.g. scaled:10)")
