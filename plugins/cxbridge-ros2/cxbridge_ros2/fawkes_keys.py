"""Keys of Fawkes' own ROS 2 plug-ins, which cxbridge ignores: one configuration serves both programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.config import Configuration

# Keys of the plug-ins of fawkes-robotino, by section.
FAWKES_KEYS: Final = {
    "/ros2/tf": frozenset(
        {"use_tf2", "use_namespace", "tf_prefix", "tf_prefix_exclusions", "static-update-interval"}
    ),
    "/ros2/clock": frozenset({"frequency"}),
}


def is_ours(tree: str, key: str) -> bool:
    """Return whether a key does not belong to Fawkes' plug-ins."""
    return key not in FAWKES_KEYS.get(tree, frozenset())


def has_ours(config: Configuration, tree: str) -> bool:
    """Return whether a section has a key that does not belong to Fawkes' plug-ins."""
    return any(is_ours(tree, key) for key in config.keys(tree))
