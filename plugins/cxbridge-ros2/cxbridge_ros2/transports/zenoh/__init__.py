"""ROS 2 over Zenoh, for robots with rmw_zenoh_cpp, by the wheel of Eclipse Zenoh: no ROS is needed here."""

from cxbridge_ros2.transports.zenoh.node import ZenohNode, join

__all__ = ["ZenohNode", "join"]
