"""The transports to nodes of ROS 2, one module or package each."""

from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import Final

TRANSPORTS: Final = {
    "dds": "cxbridge_ros2.transports.dds:join",
    "rclpy": "cxbridge_ros2.transports.rclpy:join",
    "rosbridge": "cxbridge_ros2.transports.rosbridge:join",
    "zenoh": "cxbridge_ros2.transports.zenoh:join",
}
"""The function that makes a node, ``module:function``, by its transport: see :meth:`NodeSettings.join`."""


def has_rclpy() -> bool:
    """Return whether a sourced ROS 2 has an rclpy for this Python."""
    try:
        spec = find_spec("rclpy")
    except (ImportError, ValueError):
        return False
    folders = () if spec is None else spec.submodule_search_locations or ()
    names = [f"_rclpy_pybind11{suffix}" for suffix in EXTENSION_SUFFIXES]
    return any((Path(folder) / name).is_file() for folder in folders for name in names)
