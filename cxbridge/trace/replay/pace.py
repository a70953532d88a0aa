"""The pace of a replay."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from cxbridge.clock import MICROSECONDS

_WAIT_SLICE_S: Final = 0.2  # seconds between calls of ``on_wait``


class Pace:
    """The recorded pace, accelerated or slowed down.

    :param speed: seconds of the recording per second.
    :param stop: set when the replay is to end.
    :param on_wait: called about five times a second during a wait.
    """

    def __init__(self, speed: float, stop: threading.Event, on_wait: Callable[[], None]) -> None:
        self._speed = speed
        self._stop = stop
        self._on_wait = on_wait
        self._start_s = 0.0
        self._first_us = 0

    def begin(self, position_us: int) -> None:
        """Start a round of the replay; its first event is at this position."""
        self._start_s = time.monotonic()
        self._first_us = position_us

    def wait(self, position_us: int) -> bool:
        """Wait for the time of a position; return False if the replay is to end."""
        due_s = self._start_s + (position_us - self._first_us) / MICROSECONDS / self._speed
        while (remaining_s := due_s - time.monotonic()) > 0:
            self._on_wait()
            if self._stop.wait(min(remaining_s, _WAIT_SLICE_S)):
                return False
        return not self._stop.is_set()
