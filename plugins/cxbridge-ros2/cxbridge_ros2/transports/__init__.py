"""The transports, each with a class of nodes: DDS, rclpy, rosbridge, and nodes of this process."""

from typing import Final

from msgspec import Struct


class Transport(Struct, frozen=True):
    """A transport that a configuration can name.

    :param node_class: the class of the nodes, as ``module:class``. NodeSettings.join imports the class.
    :param keys: the settings that the class takes, and that other transports may lack.
    """

    node_class: str
    keys: tuple[str, ...]


# `local` is missing, since such nodes reach only nodes of this process.
TRANSPORTS: Final = {
    "dds": Transport("cxbridge_ros2.transports.dds:DdsNode", ("domain", "reach")),
    "rclpy": Transport("cxbridge_ros2.transports.rclpy:RclpyNode", ("domain",)),
    "rosbridge": Transport("cxbridge_ros2.transports.rosbridge:RosbridgeNode", ("url",)),
}
