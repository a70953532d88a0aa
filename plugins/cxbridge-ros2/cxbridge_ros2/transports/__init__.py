"""The transports to nodes of ROS 2, one module or package each."""

from typing import Final

# The function that makes a node, ``module:function``, by its transport: see :meth:`NodeSettings.join`.
TRANSPORTS: Final = {
    "dds": "cxbridge_ros2.transports.dds:join",
    "rclpy": "cxbridge_ros2.transports.rclpy:join",
    "rosbridge": "cxbridge_ros2.transports.rosbridge:join",
    "zenoh": "cxbridge_ros2.transports.zenoh:join",
}
