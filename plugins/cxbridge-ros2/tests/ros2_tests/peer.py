"""The peer of with_rclpy/peer.py, implemented with cxbridge."""

from __future__ import annotations

import sys
from pathlib import Path

from cxbridge.clock import RealClock
from cxbridge.rights import ALL_RIGHTS
from cxbridge_ros2.actions import AbortedError, ActionServer, Execution, GoalResponse, ServedGoal
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.settings import NodeSettings

ABORTED = 13
PACKAGES = Path(__file__).parent / "packages"


def count(goal: ServedGoal) -> Execution:
    numbers = [0, 1]
    while len(numbers) <= goal.goal["order"] and not goal.is_cancel_requested:
        numbers.append((numbers[-1] + numbers[-2]) % 2**31)  # an int32
        yield {"sequence": numbers}
    if goal.goal["order"] == ABORTED:
        raise AbortedError({"sequence": numbers})
    return {"sequence": numbers}


class Fibonacci(ActionServer):
    def decide(self, served: ServedGoal) -> GoalResponse:
        return super().decide(served) if served.goal["order"] >= 0 else GoalResponse.REJECT


def make_node(transport: str = "dds", url: str = "") -> Node:
    """Make the node of the peer."""
    settings = {"transport": transport} | ({"url": url} if url else {})
    types = Definitions([PACKAGES], environment={})
    return NodeSettings.parse(settings, Path(), "peer").join("peer", types, None, ALL_RIGHTS)


def main() -> None:
    node = make_node(*sys.argv[1:])
    profile = QosProfile(depth=100)
    back = node.create_publisher("/back", "std_msgs/msg/String", profile)
    node.subscribe("/there", "std_msgs/msg/String", back.publish, profile)
    node.serve("/add", "example_interfaces/srv/AddTwoInts", lambda each: {"sum": each["a"] + each["b"]})
    server = Fibonacci(node, "/fibonacci", "example_interfaces/action/Fibonacci", count, RealClock())
    print("ready", flush=True)  # noqa: T201
    while True:
        node.poll(0.02)
        server.step()


if __name__ == "__main__":
    main()
