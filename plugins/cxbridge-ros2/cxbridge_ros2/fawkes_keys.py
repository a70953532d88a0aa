"""Keys of Fawkes' own ROS 2 plug-ins, which cxbridge ignores.

Fawkes' plug-ins and cxbridge have settings in the same sections, so that both programs can read one
configuration.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.config import Configuration

# Keys of the plug-ins in the repository fawkes-robotino, by section.
FAWKES_KEYS: Final = {
    "/ros2/tf": frozenset(
        {"use_tf2", "use_namespace", "tf_prefix", "tf_prefix_exclusions", "static-update-interval"}
    ),
    "/ros2/clock": frozenset({"frequency"}),
}


def is_cxbridge_key(section: str, key: str) -> bool:
    """Return whether a key does not belong to Fawkes' plug-ins."""
    return key not in FAWKES_KEYS.get(section, frozenset())


def has_cxbridge_keys(config: Configuration, section: str) -> bool:
    """Return whether a section has a key that does not belong to Fawkes' plug-ins."""
    return any(is_cxbridge_key(section, key) for key in config.keys(section))
