"""Settings of Fawkes' own plug-ins for ROS 2 in trees where ours are: one configuration serves both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.config import Configuration

OF_FAWKES: Final = {
    "/ros2/tf": frozenset(
        {"use_tf2", "use_namespace", "tf_prefix", "tf_prefix_exclusions", "static-update-interval"}
    ),
    "/ros2/clock": frozenset({"frequency"}),
}
"""By the path of the tree, the keys that the plug-ins of fawkes-robotino read, or its files have."""


def is_ours(tree: str, key: str) -> bool:
    """Whether a key of a tree is not one of Fawkes' plug-ins."""
    return key not in OF_FAWKES.get(tree, frozenset())


def has_ours(config: Configuration, tree: str) -> bool:
    """Whether a tree has a key that is not one of Fawkes' plug-ins."""
    return any(is_ours(tree, key) for key in config.keys(tree))
