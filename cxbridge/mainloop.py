"""The main loop: Fawkes' hooks in Fawkes' order, one loop a period of the clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum

from cxbridge.clock import Clock, Wakeup

DEFAULT_PERIOD_US = 33_333
"""Fawkes' ``/fawkes/mainapp/desired_loop_time``: 30 loops a second."""


class Hook(Enum):
    """The places in a loop where work is done, in order."""

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
    """Calls the functions that are registered at each hook, once a period.

    :param clock: the run's clock; each loop starts a period after the one before, or at once when that
        one took longer (lost time is not made up for, as in Fawkes).
    :param period_us: the desired time of a loop in microseconds.
    """

    def __init__(self, clock: Clock, period_us: int = DEFAULT_PERIOD_US) -> None:
        self.clock = clock
        self.period_us = period_us
        self.loops = 0
        self.turns = 0
        """The number of loops and :meth:`busy` sections that have begun."""
        self.working = False
        """Whether it does something now; not while it sleeps between two loops."""
        self._stopped = Wakeup()
        self._hooks: dict[Hook, list[Callable[[], object]]] = {hook: [] for hook in Hook}
        self._steps: tuple[Callable[[], object], ...] | None = None

    def add(self, hook: Hook, step: Callable[[], object]) -> None:
        """Call ``step`` at ``hook`` in every loop, after the functions registered before."""
        self._hooks[hook].append(step)
        self._steps = None

    def remove(self, hook: Hook, step: Callable[[], object]) -> None:
        """Do not call ``step`` at ``hook`` any more."""
        self._hooks[hook].remove(step)
        self._steps = None

    def run_once(self) -> None:
        """Run one loop: every hook in order; does not wait."""
        if self._steps is None:
            self._steps = tuple(step for hook in Hook for step in self._hooks[hook])
        self.turns += 1
        self.working = True
        for step in self._steps:
            step()
        self.loops += 1
        self.working = False

    def run(self, done: Callable[[], bool]) -> None:
        """Run loops, a period apart, until ``done()`` is true after one, or :meth:`stop` has been called."""
        while not self._stopped.is_set():
            start_us = self.clock.now_us()
            self.run_once()
            if done() or self._stopped.is_set():
                return
            self.clock.sleep_until(start_us + self.period_us, self._stopped)

    def stop(self) -> None:
        """Let :meth:`run` return: at once when it sleeps, else after the loop. From any thread.

        Not from a signal handler: it takes a lock that the code below the handler may hold.
        """
        self._stopped.set()

    @property
    def stopping(self) -> bool:
        """Whether :meth:`stop` has been called."""
        return self._stopped.is_set()

    @contextmanager
    def busy(self) -> Iterator[None]:
        """Count this section as work of a loop: the watchdog looks at :attr:`working`."""
        self.turns += 1
        self.working = True
        try:
            yield
        finally:
            self.working = False
