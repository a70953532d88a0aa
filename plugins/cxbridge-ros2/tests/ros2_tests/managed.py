"""The node of with_rclpy/managed.py, by cxbridge."""

from __future__ import annotations

from cxbridge.clock import RealClock
from cxbridge.events import EventBus, LogLine
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, CONFIGURE, Lifecycle
from cxbridge_ros2.parameters import Parameter, Parameters
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2.transports.dds import DdsNode


def main() -> None:
    clock = RealClock()
    node = DdsNode("managed", Definitions(distribution="iron", environment={}))
    bus = EventBus(clock)
    bus.subscribe(RosoutPublisher(node, "managed"), LogLine)
    declared = {
        "speed": Parameter(1.5),
        "names": Parameter(["a", "b"]),
        "limits.low": Parameter(3),
        "limits.deep.high": Parameter(7),
        "works": Parameter(value=True),
        "fixed": Parameter("yes", read_only=True),
    }
    parameters = Parameters(node, "managed", declared, clock)

    def configure() -> bool:
        bus.logger("Work").warn("configured")
        return True

    def clean_up() -> bool:
        raise RuntimeError("cannot clean up")

    work = {CONFIGURE: configure, ACTIVATE: lambda: bool(parameters["works"]), CLEANUP: clean_up}
    Lifecycle(node, "managed", work, clock, bus.logger("Work").error)
    print("ready", flush=True)  # noqa: T201
    while True:
        node.poll(0.05)


if __name__ == "__main__":
    main()
