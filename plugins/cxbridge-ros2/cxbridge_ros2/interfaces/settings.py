"""The configuration of interfaces as topics: ``/ros2/interfaces/NAME``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.blackboard.patterns import Pattern
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.executor import OF_NODE, NodeSettings, nested, typed
from cxbridge_ros2.qos import QosProfile, profile
from cxbridge_ros2.topics import check_topic
from cxbridge_ros2.trees import placed, values_below

if TYPE_CHECKING:
    from cxbridge.config import Configuration

TREE: Final = "/ros2/interfaces"
PUBLISH, WRITE = "publish", "write"

_KNOWN: Final = (
    *("interface", "direction", "topic", "type", "fields", "constants", "stamp", "qos", "messages"),
    *OF_NODE,
)
_MAPPED: Final = ("fields", "constants", "stamp")
_GLOB: Final = re.compile(r"[*?\[]")


class TopicSettings(Struct, frozen=True):
    """The settings of interfaces and their topics.

    :param key: the name in the configuration.
    :param direction: ``publish`` to send writes to the topic, ``write`` to write received messages.
    :param topic: None for ``/blackboard/TYPE/ID``.
    :param type: None for the generated message type.
    :param fields: paths in the message by interface field.
    :param constants: values in the message by path.
    :param stamp: the path of the time in the message; may be empty.
    :param messages: whether the interface's messages also have topics.
    """

    key: str
    pattern: Pattern
    direction: str
    topic: str | None
    type: str | None
    fields: Mapping[str, str]
    constants: Mapping[str, Any]
    stamp: str
    qos: QosProfile
    messages: bool
    node: NodeSettings


def topic_settings(config: Configuration, folder: Path) -> list[TopicSettings]:
    """Return the configured topics.

    :param folder: the base of relative paths.
    :raises CxbridgeError: if a setting is invalid; with file and line.
    """
    topics = []
    for key in config.keys(TREE):
        with placed(config, tree := f"{TREE}/{key}"):
            topics.append(_settings(key, values_below(config, tree), folder))
    return topics


def _settings(key: str, flat: Mapping[str, Any], folder: Path) -> TopicSettings:
    whose, values = f"the topic {key}", nested(flat)
    for name in values:
        if name not in _KNOWN:
            raise ConfigError(f"{whose} has no setting '{name}'", hint=did_you_mean(name, _KNOWN))
    pattern = Pattern.parse(typed(values, "interface", "", whose))
    direction = typed(values, "direction", PUBLISH, whose)
    if direction not in (PUBLISH, WRITE):
        hint = did_you_mean(direction, (PUBLISH, WRITE), f"use {PUBLISH} or {WRITE}")
        raise ConfigError(f"{whose} has no direction '{direction}'", hint=hint)
    topic, kind = typed(values, "topic", "", whose), typed(values, "type", "", whose)
    if _GLOB.search(f"{pattern.type_glob}{pattern.id_glob}") and (topic or kind or direction == WRITE):
        hint = "several interfaces can only be published, each to a topic of its own"
        raise ConfigError(f"{whose} is for one interface: write TYPE::ID", hint=hint)
    messages = typed(values, "messages", default=False, whose=whose)
    if kind and messages:
        raise ConfigError(f"{whose}: messages have topics only where no type is set")
    if not kind and (wrong := [name for name in _MAPPED if name in values]):
        raise ConfigError(f"{whose}: '{wrong[0]}' goes with a type", hint="e.g. sensor_msgs/msg/BatteryState")
    fields: dict[str, Any] = typed(values, "fields", {}, whose)
    if kind and not fields:
        hint = "e.g. fields: {voltage: voltage}: the interface's field, the message's"
        raise ConfigError(f"{whose} needs fields", hint=hint)
    constants = {
        path.removeprefix("constants/").replace("/", "."): value
        for path, value in flat.items()
        if path.startswith("constants/")
    }
    return TopicSettings(
        key=key,
        pattern=pattern,
        direction=direction,
        topic=check_topic(topic) if topic else None,
        type=kind or None,
        fields={str(name): str(path) for name, path in fields.items()},
        constants=constants,
        stamp=typed(values, "stamp", "", whose),
        qos=profile(typed(values, "qos", "default", whose)),
        messages=messages,
        node=NodeSettings.of(values, folder, whose),
    )
