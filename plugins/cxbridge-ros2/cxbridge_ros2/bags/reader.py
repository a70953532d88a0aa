"""Reader of ROS 2 bags as recorded runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, TypeVar

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Run, StoredFile
from cxbridge_ros2.bags.topics import EVENTS, FILES, SOURCES, Taker, Takers, file_of, record_of
from cxbridge_ros2.bags.unpacking import bound_unpacking
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import ACTIONS, definitions_of
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import parse_type

METADATA: Final = "cxbridge"  # prefix of the run's keys in the bag's metadata

_NS_PER_US: Final = 1000  # ROS counts nanoseconds, events microseconds

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
        left_out: Counter[str] = Counter()
        with self._opened() as bag:
            takers = Takers(self.registry, whole=any(each.topic == EVENTS for each in bag.connections))
            chosen: dict[tuple[str, str], Taker] = {}
            for each in bag.connections:
                taker = takers.of(each.topic, each.msgtype)
                if taker is not None and self._is_known(each):
                    chosen[each.topic, each.msgtype] = taker
                elif each.msgcount:
                    left_out[f"{each.topic} ({each.msgtype})"] += each.msgcount
            connections = [each for each in bag.connections if (each.topic, each.msgtype) in chosen]
            for connection, time_ns, data in self._messages(bag, connections):
                message = self._decoded(connection, time_ns, data)
                if message is not None:
                    yield from self._taken(
                        chosen[connection.topic, connection.msgtype], connection, message, time_ns
                    )
            if left_out and not takers.whole:  # otherwise the other topics repeat the events
                self.note(
                    f"left out: {', '.join(f'{topic}: {count}' for topic, count in sorted(left_out.items()))}"
                )

    def _taken(self, take: Taker, connection: Connection, message: Message, time_ns: int) -> Iterator[Event]:
        try:
            yield from take(connection.topic, message, time_ns // _NS_PER_US)
        except (KeyError, TypeError, ValueError) as error:
            kind = connection.msgtype
            self.note(f"{connection.topic} at {time_ns} ns: not a message of the known {kind}: {error}")

    def _decoded(self, connection: Connection, time_ns: int, data: bytes) -> Message | None:
        try:
            return self._codec.decode(parse_type(connection.msgtype), data)
        except CxbridgeError as error:
            self.note(f"{connection.topic} at {time_ns} ns: {error.message}")
            return None

    def metadata(self) -> Mapping[str, str]:
        """Return the run's metadata in the bag, with the ROS distribution."""
        with self._opened() as bag:
            found = {
                key.removeprefix(f"{METADATA}."): value
                for key, value in _custom_data(bag).items()
                if key.startswith(f"{METADATA}.")
            }
            return {**found, "ros_distro": bag.ros_distro} if bag.ros_distro else found

    def files(self) -> Iterator[StoredFile]:
        return self._made(FILES, file_of)

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return self._made(SOURCES, record_of)

    def _made(self, topic: str, make: Callable[[Message], T]) -> Iterator[T]:
        """Yield the contents of a topic's messages."""
        with self._opened() as bag:
            connections = [each for each in bag.connections if each.topic == topic]
            for connection, time_ns, data in self._messages(bag, connections):
                message = self._decoded(connection, time_ns, data)
                try:
                    if message is not None:
                        yield make(message)
                except ValueError as error:
                    self.note(f"{topic} at {time_ns} ns: {error}")

    def description(self) -> Iterator[str]:
        """Yield the topics with their types and numbers of messages."""
        with self._opened() as bag:
            for each in sorted(bag.connections, key=lambda each: each.topic):
                yield f"{each.topic}: {each.msgcount} x {each.msgtype}"

    # -- the bag

    @contextmanager
    def _opened(self) -> Iterator[Reader]:
        try:
            bound_unpacking()
            bag = Reader(self.path)
            bag.open()
        except (ReaderError, OSError) as error:
            raise TraceError(f"an incomplete or damaged bag of ROS 2: {error}", file=self.path) from None
        except Exception as error:  # noqa: BLE001 - damaged files raise many kinds of errors
            raise self._damaged(error) from None
        try:
            yield bag
        finally:
            bag.close()

    def _messages(
        self, bag: Reader, connections: list[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        if not connections:
            return
        messages = bag.messages([*connections, *_as_in_files(bag, connections)])
        while True:
            try:
                item = next(messages)
            except StopIteration:
                return
            except Exception as error:  # noqa: BLE001
                self.note(f"damaged from here on: {type(error).__name__}: {error}")
                return
            yield item

    def _damaged(self, error: Exception) -> TraceError:
        reason = f"{type(error).__name__}: {error}"
        return TraceError(f"a damaged bag of ROS 2: {reason}", file=self.path, hint="try: ros2 bag reindex")

    def _is_known(self, connection: Connection) -> bool:
        """Register the message type of a topic from the bag; return whether the type is known."""
        try:
            name = parse_type(connection.msgtype)
            if connection.msgdef.data:
                self._definitions.embed(connection.msgtype, connection.msgdef.data)
            self._definitions.fields(name)
        except CxbridgeError as error:
            self.note(f"{connection.topic}: {error.message}")
            return False
        return True


def _as_in_files(bag: Reader, connections: list[Connection]) -> Iterator[Connection]:
    """Yield the connections of the bag's files whose QoS differs from the metadata.yaml.

    rosbags takes these for other topics and leaves out their messages.
    """
    for file in getattr(bag.storage, "storages", ()):
        for each in connections:
            for file_connection in file.connections:
                if (file_connection.topic, file_connection.msgtype) == (
                    each.topic,
                    each.msgtype,
                ) and file_connection.ext != each.ext:
                    yield each._replace(ext=file_connection.ext)


def _custom_data(bag: Reader) -> Mapping[str, Any]:
    metadata = getattr(bag.storage, "metadata", None)
    return getattr(metadata, "custom", None) or {}
