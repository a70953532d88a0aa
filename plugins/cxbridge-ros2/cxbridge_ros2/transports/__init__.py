"""The transports, each with a class of nodes: DDS, rclpy, rosbridge, and nodes of this process."""

from typing import Final

# By transport: the function that makes a node, as ``module:function``. NodeSettings.join calls the function.
# `local` is missing, since such nodes reach only nodes of this process.
TRANSPORTS: Final = {
    "dds": "cxbridge_ros2.transports.dds:join",
    "rclpy": "cxbridge_ros2.transports.rclpy:join",
    "rosbridge": "cxbridge_ros2.transports.rosbridge:join",
}
