"""The ROS environment of this process: domain, range of discovery, and client library."""

from __future__ import annotations

import os
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from cxbridge.errors import Ros2Error
from cxbridge.numbers import parse_decimal

MAX_DDS_DOMAIN: Final = 232  # DDS computes port numbers from the domain; the port numbers of 233 exceed 65535


def read_domain_id() -> int:
    """Return ``ROS_DOMAIN_ID``, or 0 if the variable is unset or empty.

    :raises Ros2Error: if the variable is not a domain of DDS.
    """
    domain_text = os.environ.get("ROS_DOMAIN_ID", "0") or "0"
    domain_id = parse_decimal(domain_text)
    if domain_id is None or domain_id > MAX_DDS_DOMAIN:
        # 101 instead of 232: on Linux, the ports of higher domains overlap with ephemeral ports
        raise Ros2Error(
            f"ROS_DOMAIN_ID={domain_text} is not a domain",
            hint="use a number, on most systems from 0 to 101",
        )
    return domain_id


def read_discovery_range(default_range: str = "localhost") -> str:
    """Return ``ROS_AUTOMATIC_DISCOVERY_RANGE`` in lower case; ``localhost`` if ``ROS_LOCALHOST_ONLY`` is 1.

    :param default_range: the range if neither variable names one.
    """
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":  # the older variable wins, as in Jazzy's RMWs
        return "localhost"
    return os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", default_range).lower()


def has_rclpy() -> bool:
    """Return whether a sourced ROS 2 has an rclpy for this Python."""
    spec = find_spec("rclpy")
    # a ROS for another Python has the package, too, but without an extension module for this Python
    folders = () if spec is None else spec.submodule_search_locations or ()
    extension_names = [f"_rclpy_pybind11{suffix}" for suffix in EXTENSION_SUFFIXES]
    return any((Path(folder) / name).is_file() for folder in folders for name in extension_names)
