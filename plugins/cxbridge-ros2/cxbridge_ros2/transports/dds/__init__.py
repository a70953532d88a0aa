"""ROS 2 over DDS with the Python package of Eclipse Cyclone DDS, without a ROS installation."""

from cxbridge_ros2.transports.dds.node import DdsNode

__all__ = ["DdsNode"]
