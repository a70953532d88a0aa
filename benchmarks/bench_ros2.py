"""Round trips with a node of rclpy: from cxbridge and from rclpy, in turns in one run.

``ROS2_SETUP`` names the folder with the setup.bash of a ROS 2; without it nothing is measured.
``ROS2_PYTHON`` names its Python, by default ``python3``.

    python -m benchmarks ros2
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cxbridge_ros2.actions import ActionClient
    from cxbridge_ros2.node import Node

COUNT = 300
"""The number of round trips of each kind in a round; chosen freely."""
ROUNDS = 5
"""The number of turns of cxbridge and rclpy; chosen freely, odd for the sake of the medians."""
REPLY_TIMEOUT_S = 5.0
"""The time after which a round trip ends without a reply: far more than a round trip takes."""


def measure_cxbridge() -> dict[str, float]:
    """Return the medians of the round trips of cxbridge, in microseconds."""
    from cxbridge_ros2.actions import ActionClient
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.transports.dds import DdsNode
    from ros2_tests.peer import PACKAGES

    with DdsNode("bench", Definitions([PACKAGES], environment={})) as node:
        received: list[object] = []

        def median_trip_us(begin: Callable[[int], object]) -> float:
            trip_seconds = []
            for number in range(COUNT):
                before, started = len(received), time.perf_counter()
                begin(number)
                while len(received) == before and time.perf_counter() - started < REPLY_TIMEOUT_S:
                    node.poll(0.5)
                trip_seconds.append(time.perf_counter() - started)
            return statistics.median(trip_seconds) * 1e6

        node.subscribe("/back", "std_msgs/msg/String", received.append)
        publisher = node.create_publisher("/there", "std_msgs/msg/String")
        add = node.create_client("/add", "example_interfaces/srv/AddTwoInts")
        fibonacci = ActionClient(node, "/fibonacci", "example_interfaces/action/Fibonacci")
        deadline = time.monotonic() + 20  # long enough for the discovery of the peer
        while (
            not (publisher.count_subscriptions() and add.has_server and fibonacci.has_server)
            and time.monotonic() < deadline
        ):
            node.poll(0.1)
        time.sleep(1.0)  # until the other direction of the topic is matched as well
        node.poll()
        return {
            "topic": median_trip_us(lambda number: publisher.publish({"data": f"message {number}"})),
            "service": median_trip_us(lambda number: add.call({"a": number, "b": 1}, received.append)),
            "goal": statistics.median(measure_goal_seconds(node, fibonacci)) * 1e6,
        }


def measure_goal_seconds(node: Node, fibonacci: ActionClient) -> Iterator[float]:
    """Send goals one after the other, and yield the seconds from each goal to its result."""
    for _ in range(COUNT):
        started = time.perf_counter()
        sent = fibonacci.send({"order": 1})
        while not sent.is_over and time.perf_counter() - started < REPLY_TIMEOUT_S:
            node.poll(0.5)
        yield time.perf_counter() - started


def measure_rclpy() -> dict[str, float]:
    """Return the medians of rclpy's round trips, in microseconds."""
    from ros2_tests.conftest import HERE, make_ros_python_command

    command = make_ros_python_command(str(HERE / "with_rclpy/user.py"), str(COUNT))
    seconds = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    return {"topic": seconds["trip"] * 1e6, "service": seconds["call"] * 1e6, "goal": seconds["goal"] * 1e6}


def main() -> None:
    """Print the medians of all rounds, and their ratios."""
    if not os.environ.get("ROS2_SETUP"):
        print("nothing is measured: ROS2_SETUP names no ROS 2")
        return
    from ros2_tests.conftest import start_peer

    # a domain for this process, so that nodes of other programs do not take part
    os.environ.update(ROS_DOMAIN_ID=str(1 + os.getpid() % 100), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    peer = start_peer("rclpy", "peer.py")
    try:
        rounds = [(measure_cxbridge(), measure_rclpy()) for _ in range(ROUNDS)]
    finally:
        peer.kill()
        peer.wait()
    for traffic in ("topic", "service", "goal"):
        ours_us = statistics.median(ours[traffic] for ours, _ in rounds)
        rival_us = statistics.median(rival[traffic] for _, rival in rounds)
        ratio = statistics.median(ours[traffic] / rival[traffic] for ours, rival in rounds)
        print(f"{traffic}: cxbridge {ours_us:.0f} us, rclpy with itself {rival_us:.0f} us, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
