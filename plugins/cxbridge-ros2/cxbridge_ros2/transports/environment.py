"""The ROS environment of this process: its domain, its range of discovery, its client library."""

from __future__ import annotations

import os
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from cxbridge.errors import Ros2Error

MAX_DDS_DOMAIN: Final = 232  # ports of DDS allow no higher domain


def domain_id(limit: int | None = None) -> int:
    """Return ``ROS_DOMAIN_ID``, or 0 if it is unset.

    :param limit: the highest domain of the transport.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "0") or "0"
    # isdecimal() alone accepts the digits of other scripts
    if not (text.isascii() and text.isdecimal()) or (limit is not None and int(text) > limit):
        # 101 instead of 232: on Linux, the ports of higher domains overlap with ephemeral ports
        hint = "it is a number from 0 to 101 on most systems" if limit is not None else "it is a number"
        raise Ros2Error(f"ROS_DOMAIN_ID={text} is no domain", hint=hint)
    return int(text)


def default_reach(unset: str = "localhost") -> str:
    """Return the discovery range of the environment (ROS_AUTOMATIC_DISCOVERY_RANGE).

    :param unset: the range if the environment names none.
    """
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":  # the older variable wins, as in Jazzy's RMWs
        return "localhost"
    return os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", unset).lower()


def has_rclpy() -> bool:
    """Return whether a sourced ROS 2 has an rclpy for this Python."""
    try:
        spec = find_spec("rclpy")
    except (ImportError, ValueError):
        return False
    # a ROS for another Python has the folder, too, but no extension module that this Python can load
    folders = () if spec is None else spec.submodule_search_locations or ()
    names = [f"_rclpy_pybind11{suffix}" for suffix in EXTENSION_SUFFIXES]
    return any((Path(folder) / name).is_file() for folder in folders for name in names)
