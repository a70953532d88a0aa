"""Interfaces as topics: publishes writes of the blackboard, or writes received messages to it.

An interface has a writer and readers, which send messages to the writer. The writer of a
published interface is in this system, and nodes of ROS send messages to the writer. A written interface has
its writer in ROS, and readers in this system send messages there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from enum import Enum
from functools import partial
from typing import Any, Final

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.closing import Closing
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import Logger
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema
from cxbridge.rights import right_of_frame
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import TIME, field_names, type_of
from cxbridge_ros2.interfaces.settings import WRITE, TopicSettings
from cxbridge_ros2.messages import Message, value_at
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Node, Publisher
from cxbridge_ros2.stamps import us_to_stamp

OWNER: Final = "ROS 2"

_QUEUE_LIMIT: Final = 100  # messages that wait for the next loop
_SUFFIX: Final = "Message"  # the end of the names of messages, which topics leave out


def topic_of(interface_type: str, interface_id: str) -> str:
    """Return the default topic of an interface, ``/blackboard/TYPE/ID``, with other characters as ``_``."""
    token = re.sub(r"[^A-Za-z0-9]+", "_", interface_id).strip("_")
    return f"/blackboard/{interface_type}/{token if token[:1].isalpha() else f'id_{token}'}"


def check_mapping(settings: TopicSettings, schema: InterfaceSchema, definitions: Definitions) -> None:
    """Check the configured fields of an interface and its message.

    :raises CxbridgeError: if a type or field does not exist.
    """
    if settings.type is None:
        return
    kind = parse_type(settings.type)
    for path in (*_paths(settings, schema).values(), *settings.constants, *filter(None, [settings.stamp])):
        definitions.check_path(kind, path)


class PublishedInterfaces(Closing):
    """Publishes existing and future interfaces.

    :param written_uids: interfaces written from ROS, which are not sent back.
    """

    def __init__(
        self, settings: TopicSettings, node: Node, board: BlackBoard, log: Logger, written_uids: set[str]
    ) -> None:
        self._settings, self._node, self._log, self._written_uids = settings, node, log, written_uids
        self._board = board
        self._publish: dict[str, Callable[[InterfaceChange], None]] = {}
        self._publishers: list[Publisher] = []
        self._close_functions: list[Callable[[], None]] = []
        self._topics: set[str] = set()
        self._refused: set[str] = set()
        self._feed = Feed(board, OWNER)
        try:
            for instance in self._feed.follow(settings.pattern.type_glob, settings.pattern.id_glob):
                self._publish_change(self._feed.now(instance))
        except Exception:
            self.close()
            raise

    def loop(self) -> None:
        while (change := self._feed.next(Deadline(0))) is not None:
            self._publish_change(change)
        for instance in self._feed.opened:
            if instance.uid not in self._publish:  # an interface without a write so far
                self._publish_change(self._feed.now(instance))

    def _publish_change(self, change: InterfaceChange) -> None:
        if change.uid in self._written_uids or change.uid in self._refused:
            return
        try:
            publish = self._publish.get(change.uid) or self._begin(change.uid)
            if change.kind == "data" and change.time_us:  # no time: the interface was never written
                publish(change)
        except CxbridgeError as error:
            self._refused.add(change.uid)
            self._log.warn(f"{change.uid} is not published any more: {error.message}")

    def _begin(self, uid: str) -> Callable[[InterfaceChange], None]:
        interface_type, _, interface_id = uid.partition("::")
        settings, schema = self._settings, self._board.registry.get(interface_type).SCHEMA
        topic = f"{settings.node.namespace}{settings.topic or topic_of(interface_type, interface_id)}"
        if topic in self._topics:
            raise ConfigError(f"another interface has the topic {topic}")
        self._topics.add(topic)
        publisher = self._node.create_publisher(topic, settings.type or type_of(interface_type), settings.qos)
        self._publishers.append(publisher)
        paths, stamp = _paths(settings, schema), TIME if settings.type is None else settings.stamp
        if settings.messages:
            self._receive_messages(topic, self._feed.open(interface_type, interface_id))

        def publish(change: InterfaceChange) -> None:
            message: Message = {}
            for path, value in settings.constants.items():
                _put(message, path, value)
            for field, path in paths.items():
                _put(message, path, _to_ros(change.values[field]))
            if stamp:
                _put(message, stamp, us_to_stamp(change.time_us))
            publisher.publish(message)

        self._publish[uid] = publish
        return publish

    def _receive_messages(self, topic: str, instance: Interface) -> None:
        """Send the messages of an interface's topics to its writer."""
        for schema in instance.SCHEMA.messages:
            send = partial(self._send, instance, schema.name, field_names(schema.fields))
            kind = type_of(instance.type, schema.name)
            right = self._node.rights.of_message(instance.type, schema.name)
            message_topic = f"{topic}/{schema.name.removesuffix(_SUFFIX)}"
            self._close_functions.append(self._node.subscribe(message_topic, kind, send, right=right))

    def _send(self, instance: Interface, name: str, names: Mapping[str, str], message: Message) -> None:
        try:
            interface_message = instance.create_message(name)
            for field, ros_field in names.items():
                interface_message.set(field, _from_ros(interface_message.field(field), message[ros_field]))
            instance.msgq_enqueue(interface_message)
        except CxbridgeError as error:
            self._log.warn(f"{instance.uid} did not get a {name}: {error.message}")

    def close(self) -> None:
        for end in self._close_functions:
            end()
        for publisher in self._publishers:
            publisher.close()
        self._feed.close()


class WrittenInterface(Closing):
    """Writes an interface from the messages of its topic.

    :raises CxbridgeError: if the interface has another writer, or a name or type is invalid.
    """

    def __init__(self, settings: TopicSettings, node: Node, board: BlackBoard, log: Logger) -> None:
        self._settings, self._log = settings, log
        interface_type, interface_id = settings.pattern.type_glob, settings.pattern.id_glob
        self._instance = board.open_for_writing(
            interface_type, interface_id, owner=OWNER, queue_limit=_QUEUE_LIMIT
        )
        schema = self._instance.SCHEMA
        self._paths = _paths(settings, schema)
        self._reported: set[str] = set()
        topic = f"{settings.node.namespace}{settings.topic or topic_of(interface_type, interface_id)}"
        self._publishers: dict[str, tuple[Publisher, Mapping[str, str]]] = {}
        try:
            for message in schema.messages if settings.messages else ():
                kind = type_of(interface_type, message.name)
                publisher = node.create_publisher(f"{topic}/{message.name.removesuffix(_SUFFIX)}", kind)
                self._publishers[message.name] = publisher, field_names(message.fields)
            self._close_subscription = node.subscribe(
                topic,
                settings.type or type_of(interface_type),
                self._write_message,
                settings.qos,
                right=right_of_frame("ros2-interfaces", WRITE),
            )
        except Exception:
            self._instance.close()
            raise

    @property
    def uid(self) -> str:
        return self._instance.uid

    def loop(self) -> None:
        """Publish the messages of the interface's readers."""
        while (message := self._instance.msgq_pop()) is not None:
            if message.type in self._publishers:
                publisher, names = self._publishers[message.type]
                values = message.as_dict()
                publisher.publish({ros_field: _to_ros(values[field]) for field, ros_field in names.items()})

    def _write_message(self, message: Message) -> None:
        try:
            for field, path in self._paths.items():
                self._instance.set(field, _from_ros(self._instance.field(field), value_at(message, path)))
            self._instance.write()
        except CxbridgeError as error:
            if error.message not in self._reported:  # a topic may have many messages a second
                self._reported.add(error.message)
                self._log.warn(f"{self.uid} was not written: {error.message}")

    def close(self) -> None:
        self._close_subscription()
        for publisher, _ in self._publishers.values():
            publisher.close()
        self._instance.close()


def _paths(settings: TopicSettings, schema: InterfaceSchema) -> Mapping[str, str]:
    """Return the path in the message of each interface field."""
    if settings.type is None:
        return field_names(schema.fields)
    field_list = [field.name for field in schema.fields]
    for name in settings.fields:
        if name not in field_list:
            raise ConfigError(
                f"the topic {settings.key}: {schema.name} has no field '{name}'",
                hint=did_you_mean(name, field_list, f"it has: {', '.join(field_list)}"),
            )
    return settings.fields


def _to_ros(value: Any) -> Any:
    """Convert a value of an interface for a message."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()  # blocks may have invalid UTF-8
    if isinstance(value, tuple):
        return [_to_ros(element) for element in value]
    return value.value if isinstance(value, Enum) else value


def _from_ros(field: FieldSchema, value: Any) -> Any:
    """Convert a value of a message for a field of an interface."""
    if isinstance(value, bytes | list):
        return tuple(value)
    return float(value) if field.type in ("float", "double") and not isinstance(value, str) else value


def _put(message: Message, path: str, value: Any) -> None:
    *parents, field = path.split(".")
    for parent in parents:
        message = message.setdefault(parent, {})
    message[field] = value
