"""Simulated time: a clock that follows the messages on ``/clock``, such as those of Gazebo.

Between two messages time stands still, as for ROS nodes with ``use_sim_time``.
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
FIRST_S: Final = 10.0  # limit of real time in seconds for the first message

_TYPE: Final = "rosgraph_msgs/msg/Clock"
_NANOSECONDS: Final = 1000  # per microsecond
_POLL_S: Final = 0.1  # seconds of one poll for /clock
# Pause between two polls: 1000 steps a second are enough, whatever the simulator sends.
_REST_S: Final = 0.001
# Period of a sleeper's checks whether it was woken, since a paused simulation sends no messages.
_GLANCE_S: Final = 0.05
_NEVER: Final = 2**63


class SimTimeClock(Clock):
    """Follows ``/clock`` from the first query of the time on.

    Time never goes backwards: after a reset of the simulation, it continues from the old time.

    :param join: makes the node that receives the messages.
    :param patience_s: the limit of real time for the first message.
    """

    name = "ros2"

    def __init__(self, join: Callable[[], Node], patience_s: float = FIRST_S) -> None:
        self._join, self._patience_s = join, patience_s
        self._moved = threading.Condition()
        self._node: Node | None = None
        self._thread: threading.Thread | None = None
        self._is_closed = False
        self._now_us = self._offset_us = 0
        self._next_us = _NEVER  # earliest end of a sleep
        self.resets = 0  # number of times that the simulation has gone back

    def now_us(self) -> int:
        """Return the simulated time in microseconds.

        :raises Ros2Error: if no publisher sends the time, or the domain cannot be joined.
        """
        if self._thread is None:
            self._begin()
        return self._now_us

    def sleep_until(self, time_us: int, wake: Wakeup | None = None) -> None:
        if self._thread is None:
            self._begin()
        with self._moved:
            while self._now_us < time_us and not self._is_closed and (wake is None or not wake.is_set()):
                self._next_us = min(self._next_us, time_us)
                self._moved.wait(_GLANCE_S)

    def close(self) -> None:
        """Stop following; sleepers wake up."""
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
