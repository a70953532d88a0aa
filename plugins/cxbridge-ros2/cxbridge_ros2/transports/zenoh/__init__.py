"""ROS 2 over Zenoh with the Python package of Eclipse Zenoh, for robots with rmw_zenoh_cpp."""

from cxbridge_ros2.transports.zenoh.node import ZenohNode, join

__all__ = ["ZenohNode", "join"]
