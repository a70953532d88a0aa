"""Simulated time: the clock of ``--clock ros2``, which follows the messages on ``/clock``, such as Gazebo's.

Between two messages the time stands still, as for ROS nodes with ``use_sim_time``. A background thread
receives the messages. The thread of the run reads the time, and sleeps until a message wakes it.
"""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import Ros2Error
from cxbridge.rights import ALL_RIGHTS, Right
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.settings import read_node_section
from cxbridge_ros2.stamps import stamp_to_us

CLOCK_TOPIC: Final = "/clock"
FIRST_MESSAGE_TIMEOUT_S: Final = 10.0  # limit of real time for the first message
_CLOCK_SECTION: Final = "/ros2/clock"

_CLOCK_TYPE: Final = "rosgraph_msgs/msg/Clock"
_POLL_TIMEOUT_S: Final = 0.1  # the time limit of one poll for /clock
# Pause after a poll with a message: 1000 steps a second are enough, even if the simulator sends more.
_PAUSE_S: Final = 0.001
# The time between a sleeper's checks of its wake event, since a paused simulation sends no messages.
_WAKE_CHECK_S: Final = 0.05


def make_clock(config: Configuration, folder: Path) -> Clock:
    """Make a clock that follows the simulated time of ROS 2.

    :param folder: the folder of the configuration, base of relative paths.
    """
    _, settings = read_node_section(config, _CLOCK_SECTION, (), folder, "the clock of ROS 2")
    # the node joins at the first query of the time: a command that only reads the configuration has no node
    return SimTimeClock(
        lambda: settings.join("cxbridge_clock", settings.load_definitions(), None, ALL_RIGHTS)
    )


class SimTimeClock(Clock):
    """Follows ``/clock`` from the first query of the time on.

    Time never goes backwards: after a reset of the simulation, the clock continues from the old time.

    :param join_domain: makes the node that receives the messages.
    :param first_message_timeout_s: the limit of real time for the first message.
    """

    name = "ros2"

    def __init__(
        self, join_domain: Callable[[], Node], first_message_timeout_s: float = FIRST_MESSAGE_TIMEOUT_S
    ) -> None:
        self._join_domain, self._first_message_timeout_s = join_domain, first_message_timeout_s
        self._time_changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._is_closed = False
        self._now_us = 0  # stays 0 until the first message
        self._offset_us = 0  # added to the received times, so that time does not go back after a reset

    def now_us(self) -> int:
        """Return the simulated time in microseconds.

        :raises Ros2Error: at the first query, if no publisher sends the time, or the domain cannot be joined.
        """
        if self._thread is None:
            self._start_following()
        return self._now_us

    def sleep_until(self, time_us: int, wake: threading.Event | None = None) -> None:
        self.now_us()  # starts to follow, if the clock does not follow yet
        with self._time_changed:
            while self._now_us < time_us and not self._is_closed and (wake is None or not wake.is_set()):
                self._time_changed.wait(_WAKE_CHECK_S)

    def close(self) -> None:
        """Stop following; sleepers wake up."""
        with self._time_changed:
            self._is_closed = True
            self._time_changed.notify_all()
        if self._thread is not None:
            self._thread.join()
            atexit.unregister(self.close)

    def _start_following(self) -> None:
        node = self._join_domain()
        node.subscribe(CLOCK_TOPIC, _CLOCK_TYPE, self._receive, PROFILES["clock"], right=Right.LOOK)
        self._thread = threading.Thread(target=self._follow, args=(node,), name="clock of ROS 2", daemon=True)
        self._thread.start()
        atexit.register(self.close)
        with self._time_changed:
            self._time_changed.wait_for(lambda: self._now_us, self._first_message_timeout_s)
        if not self._now_us:
            self.close()
            raise Ros2Error(
                f"no time was received on {CLOCK_TOPIC} within {self._first_message_timeout_s:g} s",
                hint="is the simulation running, and is it in the same ROS_DOMAIN_ID and range of discovery?",
            )

    def _follow(self, node: Node) -> None:
        while not self._is_closed:
            if node.poll(_POLL_TIMEOUT_S):
                time.sleep(_PAUSE_S)
        node.close()

    def _receive(self, message: Message) -> None:
        sent_us = stamp_to_us(message["clock"])
        with self._time_changed:
            if sent_us + self._offset_us < self._now_us:
                self._offset_us = self._now_us - sent_us  # the simulation was reset
            self._now_us = sent_us + self._offset_us
            self._time_changed.notify_all()
