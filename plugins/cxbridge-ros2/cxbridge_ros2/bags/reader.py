"""Reader of ROS 2 bags as recorded runs.

A bag may be cut or damaged, and its types may be unknown: the reader notes each omission and continues.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any, Final, TypeVar

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Run, StoredFile
from cxbridge_ros2.bags.topics import EVENTS, FILES, SOURCES, Converter, Converters, file_of, record_of
from cxbridge_ros2.bags.unpacking import limit_unpacking
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import ACTIONS, definitions_of
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.stamps import NS_PER_US

METADATA: Final = "cxbridge"  # prefix of the run's keys in the bag's metadata

T = TypeVar("T")


class BagRun(Run):
    """A run in a bag, or a robot's bag, whose log, frames, actions and interfaces become events."""

    format = "rosbag"

    def __init__(self, path: Path, registry: InterfaceRegistry | None = None) -> None:
        super().__init__(path, registry)
        texts = dict(ACTIONS)
        for name in self.registry.names():
            texts.update(definitions_of(self.registry.schema(name)))
        self._definitions = Definitions(texts=texts)
        self._codec = Codec(self._definitions)

    def __iter__(self) -> Iterator[Event]:
        omitted: Counter[str] = Counter()
        with self._open() as bag:
            has_events = any(connection.topic == EVENTS for connection in bag.connections)
            all_converters = Converters(self.registry, has_events=has_events)
            # by topic and type, since a bag may have several connections of a topic
            converters: dict[tuple[str, str], Converter] = {}
            for connection in bag.connections:
                topic, kind = connection.topic, connection.msgtype
                converter = all_converters.of(topic, kind)
                if converter is not None and self._is_known(connection):
                    converters[topic, kind] = converter
                elif connection.msgcount:
                    omitted[f"{topic} ({kind})"] += connection.msgcount
            for connection, time_ns, data in self._messages(
                bag, lambda connection: (connection.topic, connection.msgtype) in converters
            ):
                message = self._decode(connection, time_ns, data)
                if message is not None:
                    converter = converters[connection.topic, connection.msgtype]
                    yield from self._convert(converter, connection, message, time_ns)
            if omitted and not has_events:  # otherwise the other topics repeat the events
                counts = (f"{topic}: {count}" for topic, count in sorted(omitted.items()))
                self.note(f"left out: {', '.join(counts)}")

    def _convert(
        self, convert: Converter, connection: Connection, message: Message, time_ns: int
    ) -> Iterator[Event]:
        try:
            yield from convert(connection.topic, message, time_ns // NS_PER_US)
        except (KeyError, TypeError, ValueError) as error:
            kind = connection.msgtype
            self.note(f"{connection.topic} at {time_ns} ns: not a message of the known {kind}: {error}")

    def _decode(self, connection: Connection, time_ns: int, data: bytes) -> Message | None:
        try:
            return self._codec.decode(parse_type(connection.msgtype), data)
        except CxbridgeError as error:
            self.note(f"{connection.topic} at {time_ns} ns: {error.message}")
            return None

    def metadata(self) -> Mapping[str, str]:
        """Return the metadata of the run that the bag contains, with the ROS distribution."""
        with self._open() as bag:
            # files of other tools may lack metadata; other storages lack custom data
            custom: Mapping[str, Any] = getattr(getattr(bag.storage, "metadata", None), "custom", None) or {}
            metadata = {
                key.removeprefix(f"{METADATA}."): value
                for key, value in custom.items()
                if key.startswith(f"{METADATA}.")
            }
            return {**metadata, "ros_distro": bag.ros_distro} if bag.ros_distro else metadata

    def files(self) -> Iterator[StoredFile]:
        return self._stored(FILES, file_of)

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return self._stored(SOURCES, record_of)

    def _stored(self, topic: str, parse: Callable[[Message], T]) -> Iterator[T]:
        """Yield the contents of a topic's messages."""
        with self._open() as bag:
            for connection, time_ns, data in self._messages(bag, lambda each: each.topic == topic):
                message = self._decode(connection, time_ns, data)
                try:
                    if message is not None:
                        yield parse(message)
                except ValueError as error:
                    self.note(f"{topic} at {time_ns} ns: {error}")

    def description(self) -> Iterator[str]:
        """Yield the topics with their types and numbers of messages."""
        with self._open() as bag:
            for connection in sorted(bag.connections, key=lambda connection: connection.topic):
                yield f"{connection.topic}: {connection.msgcount} x {connection.msgtype}"

    # -- the bag

    @contextmanager
    def _open(self) -> Iterator[Reader]:
        try:
            limit_unpacking()
            bag = Reader(self.path)
            bag.open()
        except (ReaderError, OSError) as error:
            raise TraceError(f"an incomplete or damaged bag of ROS 2: {error}", file=self.path) from None
        except Exception as error:  # noqa: BLE001 - damaged files raise many kinds of errors
            reason = f"{type(error).__name__}: {error}"
            raise TraceError(
                f"a damaged bag of ROS 2: {reason}", file=self.path, hint="try: ros2 bag reindex"
            ) from None
        try:
            yield bag
        finally:
            bag.close()

    def _messages(
        self, bag: Reader, is_selected: Callable[[Connection], bool]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield the messages of some connections until the end, or until the bag is damaged."""
        connections = [connection for connection in bag.connections if is_selected(connection)]
        if not connections:
            return  # to rosbags, an empty list means all connections
        messages = bag.messages([*connections, *_connections_of_files(bag, connections)])
        while True:
            try:
                item = next(messages)
            except StopIteration:
                return
            except Exception as error:  # noqa: BLE001 - damaged files raise many kinds of errors
                self.note(f"damaged from here on: {type(error).__name__}: {error}")
                return
            yield item

    def _is_known(self, connection: Connection) -> bool:
        """Register the message type of a topic from the bag; return whether the type is known."""
        try:
            name = parse_type(connection.msgtype)
            if connection.msgdef.data:
                self._definitions.add_definition(connection.msgtype, connection.msgdef.data)
            self._definitions.fields(name)
        except CxbridgeError as error:
            self.note(f"{connection.topic}: {error.message}")
            return False
        return True


def _connections_of_files(bag: Reader, connections: list[Connection]) -> Iterator[Connection]:
    """Yield the connections of the bag's files whose QoS differs from the metadata.yaml.

    Without them, rosbags leaves out the messages in these files.
    """
    for file in getattr(bag.storage, "storages", ()):
        for connection, in_file in product(connections, file.connections):
            is_same = (in_file.topic, in_file.msgtype) == (connection.topic, connection.msgtype)
            if is_same and in_file.ext != connection.ext:
                yield connection._replace(ext=in_file.ext)
