"""Reader of ROS 2 bags as recorded runs.

Either cxbridge has written the bag, with the events of a run, or a robot has recorded the bag. A bag may be
truncated or damaged: the reader notes the damage, and yields the events before it. Messages of unknown types
are omitted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any, Final, TypeVar

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Run, StoredFile
from cxbridge_ros2.bags.topics import (
    EVENTS_TOPIC,
    FILES_TOPIC,
    SOURCES_TOPIC,
    Converter,
    ConverterTable,
    decode_file,
    decode_record,
)
from cxbridge_ros2.bags.unpacking import limit_unpacking
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS, generate_definitions
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.stamps import NS_PER_US

METADATA_PREFIX: Final = "cxbridge"  # the prefix of the keys of a run in the custom metadata of a bag

ParsedT = TypeVar("ParsedT")


class BagRun(Run):
    """The events of a run in a bag. Log, frames, actions and interfaces of a robot's bag become events."""

    format = "rosbag"

    def __init__(self, path: Path, registry: InterfaceRegistry | None = None) -> None:
        super().__init__(path, registry)
        definition_texts = ACTION_DEFINITIONS | generate_definitions(
            map(self.registry.schema, self.registry.names())
        )
        self._definitions = Definitions(texts=definition_texts)
        self._codec = Codec(self._definitions)

    def __iter__(self) -> Iterator[Event]:
        omitted_counts: Counter[str] = Counter()
        with self._open() as bag:
            has_events = any(connection.topic == EVENTS_TOPIC for connection in bag.connections)
            converter_table = ConverterTable(self.registry, has_events=has_events)
            # by topic and type, since a bag may have several connections of a topic
            converters: dict[tuple[str, str], Converter] = {}
            for connection in bag.connections:
                topic, type_name = connection.topic, connection.msgtype
                converter = converter_table.find_converter(topic, type_name)
                if converter is not None and self._load_type(connection):
                    converters[topic, type_name] = converter
                elif connection.msgcount:
                    omitted_counts[f"{topic} ({type_name})"] += connection.msgcount
            for connection, time_ns, message in self._read_messages(
                bag, lambda connection: (connection.topic, connection.msgtype) in converters
            ):
                converter = converters[connection.topic, connection.msgtype]
                yield from self._convert(converter, connection, message, time_ns)
            # in a bag with events, the other messages repeat the events
            if omitted_counts and not has_events:
                counts = (f"{topic}: {count}" for topic, count in sorted(omitted_counts.items()))
                self.note(f"left out: {', '.join(counts)}")

    def _convert(
        self, convert: Converter, connection: Connection, message: Message, time_ns: int
    ) -> Iterator[Event]:
        try:
            yield from convert(connection.topic, message, time_ns // NS_PER_US)
        except (KeyError, TypeError, ValueError) as error:
            type_name = connection.msgtype
            self.note(f"{connection.topic} at {time_ns} ns: not a message of the known {type_name}: {error}")

    def metadata(self) -> Mapping[str, str]:
        """Return the metadata of the run that the bag contains, with the ROS distribution if it is known."""
        with self._open() as bag:
            # some storages have no metadata, and some metadata has no custom values
            custom_values: Mapping[str, Any] = (
                getattr(getattr(bag.storage, "metadata", None), "custom", None) or {}
            )
            metadata = {
                key.removeprefix(f"{METADATA_PREFIX}."): value
                for key, value in custom_values.items()
                if key.startswith(f"{METADATA_PREFIX}.")
            }
            return {**metadata, "ros_distro": bag.ros_distro} if bag.ros_distro else metadata

    def files(self) -> Iterator[StoredFile]:
        return self._parse_topic(FILES_TOPIC, decode_file)

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return self._parse_topic(SOURCES_TOPIC, decode_record)

    def _parse_topic(self, topic: str, parse: Callable[[Message], ParsedT]) -> Iterator[ParsedT]:
        """Yield the parsed messages of a topic of cxbridge."""
        with self._open() as bag:
            for _, time_ns, message in self._read_messages(bag, lambda connection: connection.topic == topic):
                try:
                    yield parse(message)
                except ValueError as error:
                    self.note(f"{topic} at {time_ns} ns: {error}")

    def description(self) -> Iterator[str]:
        """Yield the topics with their types and message counts."""
        with self._open() as bag:
            for connection in sorted(bag.connections, key=lambda connection: connection.topic):
                yield f"{connection.topic}: {connection.msgcount} x {connection.msgtype}"

    @contextmanager
    def _open(self) -> Iterator[Reader]:
        try:
            limit_unpacking()  # a small file could unpack to more than the memory
            bag = Reader(self.path)
            bag.open()
        except Exception as error:  # noqa: BLE001 - damaged files raise many kinds of errors in rosbags
            reason = f"{type(error).__name__}: {error}"
            raise TraceError(
                f"damaged ROS 2 bag: {reason}", file=self.path, hint="try: ros2 bag reindex"
            ) from None
        try:
            yield bag
        finally:
            bag.close()

    def _read_messages(
        self, bag: Reader, is_selected: Callable[[Connection], bool]
    ) -> Iterator[tuple[Connection, int, Message]]:
        """Yield the messages of the selected connections with their times in nanoseconds.

        Broken messages are left out, and the reader stops at the first damage of the bag.
        """
        connections = [connection for connection in bag.connections if is_selected(connection)]
        if not connections:
            return  # rosbags takes an empty list for all connections
        try:
            for connection, time_ns, encoded_message in bag.messages(
                [*connections, *_find_differing_connections(bag, connections)]
            ):
                try:
                    message = self._codec.decode(parse_type(connection.msgtype), encoded_message)
                except CxbridgeError as error:
                    self.note(f"{connection.topic} at {time_ns} ns: {error.message}")
                else:
                    yield connection, time_ns, message
        except Exception as error:  # noqa: BLE001 - damaged files raise many kinds of errors
            self.note(f"damaged from here on: {type(error).__name__}: {error}")

    def _load_type(self, connection: Connection) -> bool:
        """Load the type of a connection, from the bag if possible; return whether the type is known."""
        try:
            name = parse_type(connection.msgtype)
            if connection.msgdef.data:
                self._definitions.add_definition(connection.msgtype, connection.msgdef.data)
            self._definitions.find_fields(name)
        except CxbridgeError as error:
            self.note(f"{connection.topic}: {error.message}")
            return False
        return True


def _find_differing_connections(bag: Reader, connections: list[Connection]) -> Iterator[Connection]:
    """Yield a copy of each connection whose QoS in a file of the bag differs from that in the metadata.yaml.

    Without these connections, rosbags would leave out the messages of the files. The attribute ``ext`` of a
    connection has the QoS.
    """
    # only the reader of a folder, which has a metadata.yaml, has the attribute
    for file in getattr(bag.storage, "storages", ()):
        for connection, file_connection in product(connections, file.connections):
            is_same = (file_connection.topic, file_connection.msgtype) == (
                connection.topic,
                connection.msgtype,
            )
            if is_same and file_connection.ext != connection.ext:
                yield connection._replace(ext=file_connection.ext)
