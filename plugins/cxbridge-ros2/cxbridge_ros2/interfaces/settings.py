"""The configuration of interfaces as topics: ``/ros2/interfaces/NAME``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.blackboard.patterns import Pattern
from cxbridge.errors import ConfigError
from cxbridge_ros2.names import check_ros_name
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.settings import (
    NODE_KEYS,
    NodeSettings,
    check_choice,
    check_keys,
    locate_errors,
    nest_settings,
    read_section,
    typed_setting,
)

if TYPE_CHECKING:
    from cxbridge.config import Configuration

SECTION: Final = "/ros2/interfaces"
PUBLISH, WRITE = "publish", "write"

_KEYS: Final = (
    *("interface", "direction", "topic", "type", "fields", "constants", "stamp", "qos"),
    *NODE_KEYS,
)
# Settings that require a message type: the generated type has the fields of the interface.
_MESSAGE_TYPE_KEYS: Final = ("fields", "constants", "stamp")
_GLOB_CHARACTERS: Final = re.compile(r"[*?\[]")


class TopicSettings(Struct, frozen=True):
    """The settings of interfaces and their topics. Paths in a message have dots: ``header.stamp``.

    :param key: the name in the configuration.
    :param pattern: the pattern that matches the interfaces.
    :param direction: ``publish`` to send writes to the topic, ``write`` to write received messages.
    :param topic: the topic; None for ``/blackboard/TYPE/ID``.
    :param type_name: the message type; None for the generated type.
    :param paths: the paths in the message, by interface field; empty without a message type.
    :param constants: the constant values in the message, by path.
    :param stamp_path: the path in the message of the time of the write; empty for none.
    """

    key: str
    pattern: Pattern
    direction: str
    topic: str | None
    type_name: str | None
    paths: Mapping[str, str]
    constants: Mapping[str, Any]
    stamp_path: str
    qos: QosProfile
    node: NodeSettings


def read_topic_settings(config: Configuration, folder: Path) -> list[TopicSettings]:
    """Return the configured topics.

    :param folder: the base of relative paths.
    :raises CxbridgeError: if a setting is invalid; the error has the file and line.
    """
    topics = []
    for key in config.keys(SECTION):
        with locate_errors(config, section := f"{SECTION}/{key}"):
            topics.append(_parse_topic_settings(key, read_section(config, section), folder))
    return topics


def _parse_topic_settings(key: str, values_by_path: Mapping[str, Any], folder: Path) -> TopicSettings:
    subject, values = f"the topic {key}", nest_settings(values_by_path)
    check_keys(values, _KEYS, subject)
    pattern = Pattern.parse(typed_setting(values, "interface", "", subject))
    direction = typed_setting(values, "direction", PUBLISH, subject)
    check_choice(direction, (PUBLISH, WRITE), f"{subject} has the unknown direction '{direction}'")
    topic, type_name, profile = (
        typed_setting(values, setting, default, subject)
        for setting, default in (("topic", ""), ("type", ""), ("qos", "default"))
    )
    check_choice(profile, PROFILES, f"{subject}: there is no QoS profile '{profile}'")
    if _GLOB_CHARACTERS.search(f"{pattern.type_glob}{pattern.id_glob}") and (
        topic or type_name or direction == WRITE
    ):
        hint = "several interfaces can only be published, each to a separate topic"
        raise ConfigError(f"{subject} must name one interface, TYPE::ID", hint=hint)
    if not type_name and (unused_keys := [name for name in _MESSAGE_TYPE_KEYS if name in values]):
        raise ConfigError(
            f"{subject}: '{unused_keys[0]}' requires a 'type'", hint="e.g. sensor_msgs/msg/BatteryState"
        )
    fields: dict[str, Any] = typed_setting(values, "fields", {}, subject)
    # from the settings by path, since a nested mapping of constants stands for a path in the message
    constants = {
        path.removeprefix("constants/").replace("/", "."): value
        for path, value in values_by_path.items()
        if path.startswith("constants/")
    }
    return TopicSettings(
        key=key,
        pattern=pattern,
        direction=direction,
        topic=check_ros_name(topic) if topic else None,
        type_name=type_name or None,
        paths={str(name): str(path) for name, path in fields.items()},
        constants=constants,
        stamp_path=typed_setting(values, "stamp", "", subject),
        qos=PROFILES[profile],
        node=NodeSettings.parse(values, folder, subject),
    )
