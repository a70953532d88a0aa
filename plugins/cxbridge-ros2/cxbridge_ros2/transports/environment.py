"""The settings of the ROS environment that every transport obeys."""

from __future__ import annotations

import os
from typing import Final

from cxbridge.errors import Ros2Error

MOST_DDS_DOMAIN: Final = 232
"""The ports of DDS allow no more domains."""


def domain_id(most: int | None = None) -> int:
    """Return the number of the domain, of ``ROS_DOMAIN_ID``; 0 by default.

    :param most: that the transport can have.
    :raises Ros2Error: when it is none.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "0") or "0"
    if not (text.isascii() and text.isdecimal()) or (most is not None and int(text) > most):
        hint = "it is a number from 0 to 101 on most systems" if most is not None else "it is a number"
        raise Ros2Error(f"ROS_DOMAIN_ID={text} is no domain", hint=hint)
    return int(text)


def default_reach(unset: str = "localhost") -> str:
    """Return how far the environment lets nodes look for other nodes (ROS_AUTOMATIC_DISCOVERY_RANGE).

    :param unset: the range when the environment names none.
    """
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return "localhost"
    return os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", unset).lower()
