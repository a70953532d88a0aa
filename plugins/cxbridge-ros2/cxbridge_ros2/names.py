"""Names of ROS 2, and names of types on the wire."""

from __future__ import annotations

import re
from typing import Final

from msgspec import Struct

from cxbridge.errors import Ros2Error

KINDS: Final = ("msg", "srv", "action")
"""The folders of a package that hold definitions, and the middle part of a type's name."""

_TYPE: Final = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)")


class TypeName(Struct, frozen=True, order=True):
    """The name of a type, e.g. ``geometry_msgs/msg/PoseStamped``.

    :param package: e.g. ``geometry_msgs``.
    :param kind: ``msg``, ``srv`` or ``action``.
    :param name: e.g. ``PoseStamped``.
    """

    package: str
    kind: str
    name: str

    def __str__(self) -> str:
        return f"{self.package}/{self.kind}/{self.name}"

    def derived(self, suffix: str) -> TypeName:
        """Return the name of a type that is made of this one, e.g. that of a service's request."""
        return TypeName(self.package, self.kind, f"{self.name}_{suffix}")

    @property
    def dds(self) -> str:
        """The name on the wire, e.g. ``geometry_msgs::msg::dds_::PoseStamped_``."""
        return f"{self.package}::{self.kind}::dds_::{self.name}_"


def parse_type(text: str, kind: str = "msg") -> TypeName:
    """Return a type's name.

    :param kind: the kind of a name with two parts only: ``std_msgs/String``.
    :raises Ros2Error: when it is not the name of a type.
    """
    found = _TYPE.fullmatch(text)
    if found is None:
        raise Ros2Error(
            f"'{text}' is no name of a ROS 2 type",
            hint="write PACKAGE/msg/NAME, PACKAGE/srv/NAME or PACKAGE/action/NAME",
        )
    return TypeName(found[1], found[2] or kind, found[3])
