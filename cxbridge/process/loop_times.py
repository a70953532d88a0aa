"""Measurement of the durations of cycles."""

from __future__ import annotations

import time

from cxbridge.events import EventBus, LoopTime
from cxbridge.mainloop import Hook, MainLoop


class LoopTimes:
    """Emits :class:`~cxbridge.events.LoopTime` for each cycle if it has listeners.

    :param loop: gets two hooks around those that were added before.
    """

    def __init__(self, loop: MainLoop, bus: EventBus) -> None:
        self._loop = loop
        self._bus = bus
        self._began_ns = 0
        loop.add(Hook.PRE_LOOP, self._start_cycle)
        loop.add(Hook.POST_LOOP, self._end_cycle)

    def _start_cycle(self) -> None:
        self._began_ns = time.perf_counter_ns() if self._bus.wants(LoopTime) else 0

    def _end_cycle(self) -> None:
        if self._began_ns:
            duration_us = (time.perf_counter_ns() - self._began_ns) // 1000
            self._bus.emit(LoopTime(self._bus.clock.now_us(), self._loop.loops + 1, duration_us))
