"""The managed node of with_rclpy/managed.py, implemented with cxbridge."""

from __future__ import annotations

from itertools import count

from cxbridge.clock import RealClock
from cxbridge.events import EventBus, LogLine
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, CONFIGURE, Lifecycle
from cxbridge_ros2.parameters import Parameters, ParameterValue
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2.transports.dds import DdsNode


def main() -> None:
    clock = RealClock()
    node = DdsNode("managed", Definitions(distribution="iron", environment={}))
    bus = EventBus(clock)
    bus.subscribe(RosoutPublisher(node, "managed"), LogLine)
    declared: dict[str, ParameterValue] = {
        "speed": 1.5,
        "names": ["a", "b"],
        "limits.low": 3,
        "limits.deep.high": 7,
        "works": True,
        "fixed": "yes",
    }
    Parameters(node, "managed", declared, clock)
    attempts = count()

    def configure() -> bool:
        bus.logger("Work").warn("configured")
        return True

    def clean_up() -> bool:
        raise RuntimeError("cannot clean up")

    callbacks = {CONFIGURE: configure, ACTIVATE: lambda: next(attempts) > 0, CLEANUP: clean_up}
    Lifecycle(node, "managed", callbacks, clock, bus.logger("Work").error)
    print("ready", flush=True)  # noqa: T201
    while True:
        node.poll(0.05)


if __name__ == "__main__":
    main()
