"""Interfaces as topics: publishes writes of the blackboard, or writes received messages to the blackboard.

The writer of a published interface is on the blackboard, that of a written interface is a node of ROS.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any, Final

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.closing import Closing
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import Logger
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.rights import right_of_frame
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import TIME_FIELD, make_ros_field_names, make_ros_message_type
from cxbridge_ros2.interfaces.settings import WRITE, TopicSettings
from cxbridge_ros2.messages import Message, find_value
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Node
from cxbridge_ros2.settings import check_choice
from cxbridge_ros2.stamps import us_to_stamp

OWNER: Final = "ROS 2"  # the owner of the opened interfaces, as the blackboard lists it


def _find_topic_and_type(settings: TopicSettings, interface_type: str, interface_id: str) -> tuple[str, str]:
    """Return the topic of an interface, by default ``/blackboard/TYPE/ID``, and the message type.

    In the id, ``_`` replaces the characters that are invalid in ROS. ``id_`` precedes an id that does not
    begin with a letter, since ROS forbids a digit there.
    """
    token = re.sub(r"[^A-Za-z0-9]+", "_", interface_id).strip("_")
    default_topic = f"/blackboard/{interface_type}/{token if token[:1].isalpha() else f'id_{token}'}"
    topic = f"{settings.node.namespace}{settings.topic or default_topic}"
    return topic, settings.type_name or make_ros_message_type(interface_type)


def check_mapping(settings: TopicSettings, schema: InterfaceSchema, definitions: Definitions) -> None:
    """Check that the configured fields exist in an interface and in the message type.

    :raises CxbridgeError: if a type or field does not exist.
    """
    if settings.type_name is None:
        return
    type_name = parse_type(settings.type_name)
    stamp_paths = filter(None, [settings.stamp_path])
    for path in (*_find_message_paths(settings, schema).values(), *settings.constants, *stamp_paths):
        definitions.check_path(type_name, path)


class PublishedInterfaces(Closing):
    """Publishes the existing and future interfaces that match a pattern.

    :param written_uids: the interfaces that are written from ROS, and so are not published.
    """

    def __init__(
        self, settings: TopicSettings, node: Node, board: BlackBoard, log: Logger, written_uids: set[str]
    ) -> None:
        self._settings, self._node, self._board, self._log = settings, node, board, log
        self._publish_functions: dict[str, Callable[[InterfaceChange], None]] = dict.fromkeys(
            written_uids, _ignore_change
        )
        self._used_topics: set[str] = set()
        self._feed = Feed(board, OWNER)
        self._feed.follow(settings.pattern.type_glob, settings.pattern.id_glob)

    def loop(self) -> None:
        while (change := self._feed.wait_for_change(Deadline(0))) is not None:
            self._publish_change(change)
        for instance in self._feed.instances:
            # an interface that existed before, or without a write so far, has no change
            if instance.uid not in self._publish_functions:
                self._publish_change(self._feed.read_state(instance))

    def _publish_change(self, change: InterfaceChange) -> None:
        try:
            publish = self._publish_functions.get(change.uid) or self._start_publishing(change.uid)
            if change.kind == "data" and change.time_us:  # an interface without a write has the time 0
                publish(change)
        except CxbridgeError as error:
            self._publish_functions[change.uid] = _ignore_change
            self._log.warn(f"{change.uid} is not published: {error.message}")

    def _start_publishing(self, uid: str) -> Callable[[InterfaceChange], None]:
        """Announce the publisher of an interface, and return the function that publishes a change.

        :raises ConfigError: if another interface has the topic, or the interface lacks a configured field.
        """
        interface_type, _, interface_id = uid.partition("::")
        settings, schema = self._settings, self._board.registry.get(interface_type).SCHEMA
        topic, message_type = _find_topic_and_type(settings, interface_type, interface_id)
        if topic in self._used_topics:
            raise ConfigError(f"another interface has the topic {topic}")
        self._used_topics.add(topic)
        publisher = self._node.create_publisher(topic, message_type, settings.qos)
        paths = _find_message_paths(settings, schema)
        stamp_path = TIME_FIELD if settings.type_name is None else settings.stamp_path

        def publish(change: InterfaceChange) -> None:
            message: Message = {}
            for path, value in settings.constants.items():
                _set_field(message, path, value)
            for field, path in paths.items():
                _set_field(message, path, _to_ros(change.values[field]))
            if stamp_path:
                _set_field(message, stamp_path, us_to_stamp(change.time_us))
            publisher.publish(message)

        self._publish_functions[uid] = publish
        return publish

    def close(self) -> None:
        self._feed.close()


def _ignore_change(_change: InterfaceChange) -> None:
    """Publish nothing: the interface is written from ROS, or could not be published."""


class WrittenInterface(Closing):
    """Writes an interface from the messages of its topic.

    :raises CxbridgeError: if the interface has another writer, or a name or type is invalid.
    """

    def __init__(self, settings: TopicSettings, node: Node, board: BlackBoard) -> None:
        self._node = node
        # the settings of a written interface have no wildcards: the globs are a type and an id
        interface_type, interface_id = settings.pattern.type_glob, settings.pattern.id_glob
        self._instance = board.open_for_writing(interface_type, interface_id, owner=OWNER)
        self._message_paths = _find_message_paths(settings, self._instance.SCHEMA)
        topic, message_type = _find_topic_and_type(settings, interface_type, interface_id)
        right = right_of_frame("ros2-interfaces", WRITE)
        node.subscribe(topic, message_type, self._write_message, settings.qos, right=right)

    @property
    def uid(self) -> str:
        return self._instance.uid

    def _write_message(self, message: Message) -> None:
        try:
            for field, path in self._message_paths.items():
                self._instance.set(field, _to_interface_value(find_value(message, path)))
            self._instance.write()
        except CxbridgeError as error:
            self._node.complain(f"write {self.uid}", f"{self.uid} was not written: {error.message}")

    def close(self) -> None:
        self._instance.close()


def _find_message_paths(settings: TopicSettings, schema: InterfaceSchema) -> Mapping[str, str]:
    """Return the path in the message of each interface field.

    :raises ConfigError: if the interface lacks a configured field.
    """
    if settings.type_name is None:
        return make_ros_field_names(schema.fields)
    interface_fields = [field.name for field in schema.fields]
    for name in settings.paths:
        problem = f"the topic {settings.key}: {schema.name} has no field '{name}'"
        check_choice(name, interface_fields, problem)
    return settings.paths


def _to_ros(value: Any) -> Any:
    """Return the value of an interface field as the value of a message field."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()  # strings of interfaces may have invalid UTF-8
    if isinstance(value, tuple):
        return [_to_ros(element) for element in value]
    return value.value if isinstance(value, Enum) else value


def _to_interface_value(value: Any) -> Any:
    """Return the value of a message field as the value of an interface field."""
    return tuple(value) if isinstance(value, bytes | list) else value


def _set_field(message: Message, path: str, value: Any) -> None:
    *parents, field = path.split(".")
    for parent in parents:
        message = message.setdefault(parent, {})
    message[field] = value
