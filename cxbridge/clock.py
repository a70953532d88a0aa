"""The time that everything asks for, and waits on: real, scaled or virtual.

Times are integers: microseconds since the epoch (1970-01-01 UTC), as exact as Fawkes'
``(seconds, microseconds)`` pairs and cheap to compare.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from contextlib import suppress
from functools import cached_property

from cxbridge.errors import ConfigError

MICROSECONDS = 1_000_000
"""Microseconds in a second."""

_MAX_US = 2**63 - 1

MIN_FACTOR, MAX_FACTOR = 1e-6, 1e6
"""How slow and how fast a scaled clock can go."""

VIRTUAL_EPOCH_US = 1_000_000_000 * MICROSECONDS
"""Where a virtual clock starts: 2001-09-09 01:46:40 UTC. Fixed, so that runs repeat to the byte."""


def split_us(time_us: int) -> tuple[int, int]:
    """Split microseconds since the epoch into Fawkes' ``(seconds, microseconds)``."""
    return divmod(time_us, MICROSECONDS)


def join_us(seconds: int, microseconds: int) -> int:
    """Join Fawkes' ``(seconds, microseconds)`` to microseconds since the epoch; 64 signed bits at most.

    A writer may stamp an interface with any two numbers: a reader must not fail to pass them on.
    """
    return max(-_MAX_US, min(seconds * MICROSECONDS + microseconds, _MAX_US))


class Wakeup:
    """Ends a sleep early, and every later one, once it is set. For one sleeper; set from any thread.

    It is :class:`threading.Event` for a loop that sleeps 30 times a second: that one makes a lock and a list
    entry for each wait, and takes three times as long.
    """

    def __init__(self) -> None:
        self._is_set = False
        self._lock = threading.Lock()
        self._lock.acquire()  # held until it is set

    def is_set(self) -> bool:
        """Return whether it has been set."""
        return self._is_set

    def set(self) -> None:
        """Set it. Once more changes nothing."""
        if not self._is_set:
            self._is_set = True
            with suppress(RuntimeError):  # two set it at once: the other one has released it
                self._lock.release()

    def wait(self, seconds: float) -> None:
        """Return after that time, or as soon as the wakeup is set."""
        if not self._is_set:
            self._lock.acquire(timeout=seconds)


class Clock(ABC):
    """Gives the time and waits for it."""

    name: str
    """The clock as the command line spells it: ``virtual``, ``real``, ``scaled:N`` or ``ros2``."""

    @abstractmethod
    def now_us(self) -> int:
        """Return the time in microseconds since the epoch."""

    @cached_property
    def start_us(self) -> int:
        """The time when it was first asked for this: seconds into the run count from here, in every view."""
        return self.now_us()

    @abstractmethod
    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:
        """Return when :meth:`now_us` has reached ``time_us``; at once when it already has.

        :param wake: return earlier when this is set.
        """

    @property
    def is_virtual(self) -> bool:
        """Whether time passes only in :meth:`sleep_until`."""
        return False

    def close(self) -> None:  # noqa: B027  most have nothing
        """Release the clock's resources."""


class RealClock(Clock):
    """The machine's time. Never goes backwards: it is the wall clock at start plus monotonic time since."""

    name = "real"

    def __init__(self) -> None:
        self._start_wall_us = time.time_ns() // 1000
        self._start_mono_ns = time.monotonic_ns()

    def now_us(self) -> int:
        """Return the wall time in microseconds since the epoch."""
        return self._start_wall_us + (time.monotonic_ns() - self._start_mono_ns) // 1000

    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:
        """Sleep for the rest of the time until ``time_us``, or until ``wake`` is set."""
        remaining_us = time_us - self.now_us()
        if remaining_us > 0:
            self._sleep(remaining_us / MICROSECONDS, wake)

    @staticmethod
    def _sleep(seconds: float, wake: Wakeup | None) -> None:
        if wake is None:
            time.sleep(seconds)
        else:
            wake.wait(min(seconds, threading.TIMEOUT_MAX))


class ScaledClock(RealClock):
    """The machine's time since the start, multiplied.

    :param factor: how many seconds pass in one real second.
    """

    def __init__(self, factor: float) -> None:
        if not MIN_FACTOR <= factor <= MAX_FACTOR:
            raise ConfigError(
                f"a clock cannot run at {factor:g} times real time",
                hint=f"use a factor from {MIN_FACTOR:g} to {MAX_FACTOR:g}",
            )
        super().__init__()
        self.factor = factor
        self.name = f"scaled:{factor:g}"

    def now_us(self) -> int:
        """Return the scaled time in microseconds since the epoch."""
        elapsed_us = super().now_us() - self._start_wall_us
        return self._start_wall_us + int(elapsed_us * self.factor)

    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:
        """Sleep for the rest of the scaled time until ``time_us``, or until ``wake`` is set."""
        remaining_us = time_us - self.now_us()
        if remaining_us > 0:
            self._sleep(remaining_us / self.factor / MICROSECONDS, wake)


class VirtualClock(Clock):
    """Time that passes only in a sleep: runs repeat, and take no longer than their work."""

    name = "virtual"

    def __init__(self, start_us: int = VIRTUAL_EPOCH_US) -> None:
        self._now_us = start_us

    def now_us(self) -> int:
        """Return the virtual time in microseconds since the epoch."""
        return self._now_us

    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:  # noqa: ARG002
        """Move the clock to ``time_us``; never backwards."""
        self._now_us = max(self._now_us, time_us)

    @property
    def is_virtual(self) -> bool:
        """Return True: time passes only in a sleep."""
        return True


def make_clock(spec: str) -> Clock:
    """Make a clock from its name on the command line: ``virtual``, ``real`` or ``scaled:N``.

    :raises ConfigError: when the name is none of these.
    """
    if spec == "virtual":
        return VirtualClock()
    if spec == "real":
        return RealClock()
    kind, _, factor = spec.partition(":")
    if kind == "scaled":
        try:
            return ScaledClock(float(factor))
        except ValueError:
            pass
    raise ConfigError(f"unknown clock '{spec}'", hint="use virtual, real, or scaled:N (e.g. scaled:10)")
