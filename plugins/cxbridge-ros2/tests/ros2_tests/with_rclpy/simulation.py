"""A simulation that publishes /clock like Gazebo; the arguments are the domain and the speed."""

import sys
import time

import rclpy
from rclpy.qos import QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy
from rosgraph_msgs.msg import Clock

STEP_NS = 10_000_000


def main() -> None:
    domain, speed = int(sys.argv[1]), float(sys.argv[2])
    rclpy.init(read_domain_id=domain)
    node = rclpy.create_node("simulation")
    qos = QoSProfile(
        depth=1, history=QoSHistoryPolicy.KEEP_LAST, reliability=QoSReliabilityPolicy.BEST_EFFORT
    )
    publisher = node.create_publisher(Clock, "/clock", qos)
    print("ready", flush=True)  # noqa: T201
    now_ns = 0
    while True:
        now_ns += STEP_NS
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now_ns, 10**9)
        publisher.publish(message)
        time.sleep(STEP_NS / 1e9 / speed)


main()
