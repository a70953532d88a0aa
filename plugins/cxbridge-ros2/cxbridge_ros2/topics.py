"""Names of topics, services and actions."""

from __future__ import annotations

import re
from typing import Final

from cxbridge.errors import Ros2Error

_TOPIC: Final = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")


def check_topic(name: str) -> str:
    """Return the absolute name of a topic, a service or an action: ``/robot1/odom``.

    :raises Ros2Error: if the name is invalid in ROS.
    """
    if _TOPIC.fullmatch(name) is None or "__" in name:
        raise Ros2Error(
            f"'{name}' is no whole name of a topic, a service or an action",
            hint="it begins with / and has letters, digits and single _",
        )
    return name
