"""Settings of the ROS environment, for all transports."""

from __future__ import annotations

import os
from typing import Final

from cxbridge.errors import Ros2Error

MOST_DDS_DOMAIN: Final = 232  # ports of DDS allow no higher domain


def domain_id(most: int | None = None) -> int:
    """Return ``ROS_DOMAIN_ID``, or 0 if it is unset.

    :param most: the highest domain of the transport.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "0") or "0"
    if not (text.isascii() and text.isdecimal()) or (most is not None and int(text) > most):
        hint = "it is a number from 0 to 101 on most systems" if most is not None else "it is a number"
        raise Ros2Error(f"ROS_DOMAIN_ID={text} is no domain", hint=hint)
    return int(text)


def default_reach(unset: str = "localhost") -> str:
    """Return the discovery range of the environment (ROS_AUTOMATIC_DISCOVERY_RANGE).

    :param unset: the range if the environment names none.
    """
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return "localhost"
    return os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", unset).lower()
