"""ROS 2 over DDS, by the wheel of Eclipse Cyclone DDS: no ROS installation is needed."""

from cxbridge_ros2.transports.dds.node import DdsNode, join

__all__ = ["DdsNode", "join"]
