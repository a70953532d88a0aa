"""The names of types, topics, services and actions in ROS 2."""

from __future__ import annotations

import re
from typing import Final

from msgspec import Struct

from cxbridge.errors import Ros2Error

_ROS_NAME_PATTERN: Final = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
_TYPE_PATTERN: Final = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)")
# The suffix of a type that ROS derives from a service or an action.
_DERIVED_SUFFIX_PATTERN: Final = re.compile(
    r"(_(SendGoal|GetResult))?_(Request|Response|Event)$"
    r"|_(SendGoal|GetResult|FeedbackMessage|Goal|Result|Feedback)$"
)


class TypeName(Struct, frozen=True, order=True):
    """The name of a type, such as ``geometry_msgs/msg/PoseStamped``.

    :param kind: ``msg``, ``srv`` or ``action``.
    """

    package: str
    kind: str
    name: str

    def __str__(self) -> str:
        return f"{self.package}/{self.kind}/{self.name}"

    def derive(self, suffix: str) -> TypeName:
        """Return the name of a type that ROS derives from this type, such as the request of a service."""
        return TypeName(self.package, self.kind, f"{self.name}_{suffix}")

    @property
    def definition(self) -> TypeName:
        """The message, service or action whose definition contains this type."""
        if self.kind == "msg":  # the name of a message may end like that of a derived type
            return self
        return TypeName(self.package, self.kind, _DERIVED_SUFFIX_PATTERN.sub("", self.name))

    @property
    def dds_name(self) -> str:
        """The name on the wire, such as ``geometry_msgs::msg::dds_::PoseStamped_``."""
        return f"{self.package}::{self.kind}::dds_::{self.name}_"


def parse_type(text: str, kind: str = "msg") -> TypeName:
    """Parse a type's name.

    :param kind: the kind of a name without a middle part: ``std_msgs/String``.
    :raises Ros2Error: if the text is not a type name.
    """
    match = _TYPE_PATTERN.fullmatch(text)
    if match is None:
        raise Ros2Error(
            f"'{text}' is not the name of a ROS 2 type",
            hint="write PACKAGE/msg/NAME, PACKAGE/srv/NAME or PACKAGE/action/NAME",
        )
    return TypeName(match[1], match[2] or kind, match[3])


def check_ros_name(name: str) -> str:
    """Return a name unchanged if it is an absolute name of a topic, a service or an action: ``/robot1/odom``.

    :raises Ros2Error: if the name is relative, or invalid in ROS.
    """
    # ROS 2 reserves two underscores in a row for the conversion of names, such as / to __
    if _ROS_NAME_PATTERN.fullmatch(name) is None or "__" in name:
        raise Ros2Error(
            f"'{name}' is not an absolute name of a topic, a service or an action",
            hint="a name begins with / and has letters, digits and single _",
        )
    return name
