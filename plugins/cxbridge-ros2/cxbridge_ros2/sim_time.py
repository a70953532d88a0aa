"""Simulated time: a clock that goes as the messages on ``/clock`` say, e.g. those of Gazebo.

Between two messages time stands still, as it does for the nodes of ROS with ``use_sim_time``.
"""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Callable
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock, Wakeup
from cxbridge.errors import Ros2Error
from cxbridge.rights import Right
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES

TOPIC: Final = "/clock"
FIRST_S: Final = 10.0
"""Seconds of real time to wait for the first message."""

_TYPE: Final = "rosgraph_msgs/msg/Clock"
_NANOSECONDS: Final = 1000
_POLL_S: Final = 0.1
_REST_S: Final = 0.001
"""Between two looks: a thousand steps a second are enough, whatever the simulator sends."""
_GLANCE_S: Final = 0.05
"""A sleeper looks that often whether it was woken: the simulation may be paused."""
_NEVER: Final = 2**63


class SimTimeClock(Clock):
    """Follows ``/clock``; it begins to when it is asked for the time first.

    Time never goes backwards: after a reset of the simulation, it continues from the old time.

    :param join: makes the node that receives the messages.
    :param patience_s: seconds of real time to wait for the first message.
    """

    name = "ros2"

    def __init__(self, join: Callable[[], Node], patience_s: float = FIRST_S) -> None:
        self._join, self._patience_s = join, patience_s
        self._moved = threading.Condition()
        self._node: Node | None = None
        self._thread: threading.Thread | None = None
        self._is_closed = False
        self._now_us = self._offset_us = 0
        self._next_us = _NEVER
        """The earliest time that a sleep ends."""
        self.resets = 0
        """How often the simulation has gone back."""

    def now_us(self) -> int:
        """Return the simulated time in microseconds.

        :raises Ros2Error: when there is none: no publisher sends it, or the domain cannot be joined.
        """
        if self._thread is None:
            self._begin()
        return self._now_us

    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:
        """Sleep until the messages have reached ``time_us``, or ``wake`` is set."""
        if self._thread is None:
            self._begin()
        with self._moved:
            while self._now_us < time_us and not self._is_closed and (wake is None or not wake.is_set()):
                self._next_us = min(self._next_us, time_us)
                self._moved.wait(_GLANCE_S)

    def close(self) -> None:
        """Follow no more; who sleeps wakes up."""
        with self._moved:
            self._is_closed = True
            self._moved.notify_all()
        if self._thread is not None:
            self._thread.join()
            atexit.unregister(self.close)

    def _begin(self) -> None:
        self._node = node = self._join()
        node.subscribe(TOPIC, _TYPE, self._take, PROFILES["clock"], needs=Right.LOOK)
        self._thread = threading.Thread(target=self._follow, args=(node,), name="clock of ROS 2", daemon=True)
        self._thread.start()
        atexit.register(self.close)
        deadline = time.monotonic() + self._patience_s
        with self._moved:
            while not self._now_us and time.monotonic() < deadline:
                self._next_us = 0
                self._moved.wait(_GLANCE_S)
        if not self._now_us:
            self.close()
            raise Ros2Error(
                f"no time came on {TOPIC} within {self._patience_s:g} s",
                hint="does the simulation run, and is it in the same ROS_DOMAIN_ID and range of discovery?",
            )

    def _follow(self, node: Node) -> None:
        while not self._is_closed:
            if node.poll(_POLL_S):
                time.sleep(_REST_S)
        node.close()

    def _take(self, message: Message) -> None:
        stamp = message["clock"]
        sent_us = stamp["sec"] * MICROSECONDS + stamp["nanosec"] // _NANOSECONDS
        with self._moved:
            if sent_us + self._offset_us < self._now_us:
                self.resets += 1
                self._offset_us = self._now_us - sent_us
            self._now_us = sent_us + self._offset_us
            if self._now_us >= self._next_us:
                self._next_us = _NEVER
                self._moved.notify_all()
