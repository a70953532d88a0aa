"""The main loop: Fawkes' hooks in Fawkes' order, one cycle per period of the clock."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum

from cxbridge.clock import Clock

DEFAULT_PERIOD_US = 33_333
"""Fawkes' ``/fawkes/mainapp/desired_loop_time``: 30 cycles a second."""


class Hook(Enum):
    """The hooks of a cycle in order."""

    PRE_LOOP = "pre_loop"
    SENSOR_ACQUIRE = "sensor_acquire"
    SENSOR_PREPARE = "sensor_prepare"
    SENSOR_PROCESS = "sensor_process"
    WORLDSTATE = "worldstate"
    THINK = "think"
    SKILL = "skill"
    ACT = "act"
    ACT_EXEC = "act_exec"
    POST_LOOP = "post_loop"


class MainLoop:
    """Calls the registered functions of each hook once per period.

    :param clock: each cycle starts a period after the start of the previous cycle, or immediately if that
        cycle took longer. Later cycles do not make up for lost time, as in Fawkes.
    :param period_us: the period in microseconds.
    """

    def __init__(self, clock: Clock, period_us: int = DEFAULT_PERIOD_US) -> None:
        self.clock, self.period_us = clock, period_us
        self.cycle_count = 0
        """The number of finished cycles."""
        self.turn_count = 0
        """The number of started cycles and :meth:`busy_section` blocks."""
        self.is_working = False
        """Whether a cycle or a :meth:`busy_section` is running."""
        self._stopped = threading.Event()
        self._hooks: dict[Hook, list[Callable[[], object]]] = {hook: [] for hook in Hook}
        self._steps: tuple[Callable[[], object], ...] | None = None  # None after a change of the hooks

    def add(self, hook: Hook, step: Callable[[], object]) -> None:
        """Call ``step`` at ``hook`` in every cycle, after earlier registered functions."""
        self._hooks[hook].append(step)
        self._steps = None

    def remove(self, hook: Hook, step: Callable[[], object]) -> None:
        """Stop calling ``step`` at ``hook``.

        :raises ValueError: if the step is not registered at the hook.
        """
        self._hooks[hook].remove(step)
        self._steps = None

    def run_once(self) -> None:
        """Run one cycle without waiting."""
        if self._steps is None:
            self._steps = tuple(step for hook in Hook for step in self._hooks[hook])
        with self.busy_section():
            for step in self._steps:
                step()
            self.cycle_count += 1

    def run(self, is_done: Callable[[], bool]) -> None:
        """Run cycles until ``is_done()`` returns True after a cycle, or :meth:`stop` is called."""
        while not self._stopped.is_set():
            start_us = self.clock.now_us()
            self.run_once()
            # without the check of the event, a virtual clock would advance after a stop within the cycle
            if is_done() or self._stopped.is_set():
                return
            self.clock.sleep_until(start_us + self.period_us, self._stopped)

    def stop(self) -> None:
        """Make :meth:`run` return after the present cycle; callable from any thread.

        A signal handler must not call this method, because the interrupted code may hold the event's lock.
        """
        self._stopped.set()

    @property
    def is_stopping(self) -> bool:
        """Whether :meth:`stop` was called."""
        return self._stopped.is_set()

    @contextmanager
    def busy_section(self) -> Iterator[None]:
        """Count the block as a turn, so that the watchdog also limits work outside of cycles."""
        self.turn_count += 1
        self.is_working = True
        try:
            yield
        finally:
            self.is_working = False
