"""Writer of runs as ROS 2 bags.

Each event is a message with JSON on a topic of cxbridge, from which the reader restores the run. Log lines
are also on /rosout, and frames on /tf or /tf_static, where the tools of ROS look for them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, InterfaceWrite, LogLine, SourceRead
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.base import Attachment, RunWriter
from cxbridge.trace.formats.files import writing
from cxbridge.trace.source_records import SourceRecordMaker
from cxbridge_ros2.bags.reader import METADATA_PREFIX
from cxbridge_ros2.bags.topics import (
    EVENTS_TOPIC,
    FILES_TOPIC,
    SOURCES_TOPIC,
    TEXT_TYPE,
    encode_file,
    encode_record,
)
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.frames import TF_MESSAGE_TYPE, encode_transform
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.rosout import LOG_TYPE, make_log_message
from cxbridge_ros2.stamps import NS_PER_US

_METADATA_VERSION: Final = 9  # version of the metadata.yaml, that of ROS 2 Jazzy
_TRANSFORM_UID_PREFIX: Final = "TransformInterface::"
# Later times may overflow the signed 64-bit nanoseconds of a bag, of which this is half: about the year 2116.
_MAX_TIME_US: Final = 2**62 // NS_PER_US


class BagWriter(RunWriter):
    """Writes a run to a bag in a new folder.

    :raises TraceError: if the folder exists or cannot be created.
    """

    def __init__(self, path: Path, storage: StoragePlugin) -> None:
        self.path = path
        self._definitions = Definitions(environment={})
        self._codec = Codec(self._definitions)
        self._connections: dict[str, Connection] = {}  # by topic
        self._last_us = 0
        self._record_maker = SourceRecordMaker()
        with _convert_errors(path):
            path.parent.stat()  # raises the error about a missing parent folder, which rosbags would create
            self._bag = Writer(path, version=_METADATA_VERSION, storage_plugin=storage)
            self._bag.open()
        self._is_open = True

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        return level.event_types | {SourceRead}

    def write(self, event: Event) -> None:
        """Write an event, and the message for the tools of ROS if the event has one."""
        if isinstance(event, SourceRead):
            record, attachment = self._record_maker.make_record(event)
            if attachment is not None:
                self.attach(attachment)
            self._write_message(SOURCES_TOPIC, TEXT_TYPE, event.time_us, encode_record(record))
            return
        self._write_message(
            EVENTS_TOPIC, TEXT_TYPE, event.time_us, {"data": _to_ros_text(encode_with_kind(event))}
        )
        if isinstance(event, LogLine):
            self._write_message("/rosout", LOG_TYPE, event.time_us, make_log_message(event, event.component))
        elif isinstance(event, InterfaceWrite) and event.uid.startswith(_TRANSFORM_UID_PREFIX):
            topic = "/tf_static" if event.values.get("static_transform") else "/tf"
            transform = encode_transform(event.values, event.time_us)
            self._write_message(topic, TF_MESSAGE_TYPE, event.time_us, {"transforms": [transform]})

    def attach(self, attachment: Attachment) -> None:
        self._write_message(
            FILES_TOPIC,
            TEXT_TYPE,
            attachment.time_us or self._last_us,  # an attachment without a time follows all events so far
            encode_file(attachment),
        )

    def describe(self, metadata: Mapping[str, str]) -> None:
        for key, value in metadata.items():
            self._bag.set_custom_data(f"{METADATA_PREFIX}.{key}", value)

    def flush(self) -> None:
        """Do nothing: a bag is readable only after closing."""

    def close(self) -> None:
        if self._is_open:
            self._is_open = False
            with _convert_errors(self.path):
                self._bag.close()

    def _write_message(self, topic: str, message_type: str, time_us: int, message: Message) -> None:
        name = parse_type(message_type)
        encoded_message = self._codec.encode(name, message)
        self._last_us = max(0, min(time_us, _MAX_TIME_US))  # MCAP has no times before the epoch
        with _convert_errors(self.path):
            if topic not in self._connections:
                self._connections[topic] = self._bag.add_connection(
                    topic, message_type, typestore=self._definitions.store
                )
            self._bag.write(self._connections[topic], self._last_us * NS_PER_US, encoded_message)


@contextmanager
def _convert_errors(path: Path) -> Iterator[None]:
    """Convert errors of rosbags and of the operating system to `TraceError`."""
    try:
        with writing(path):
            yield
    except WriterError as error:
        raise TraceError(f"cannot be written: {error}", file=path) from None


def open_mcap(path: Path, _registry: InterfaceRegistry) -> BagWriter:
    return BagWriter(path, StoragePlugin.MCAP)


def open_sqlite3(path: Path, _registry: InterfaceRegistry) -> BagWriter:
    return BagWriter(path, StoragePlugin.SQLITE3)


def _to_ros_text(event_json: bytes) -> str:
    """Return JSON as a text without invalid UTF-8 and NULs, which ROS strings cannot contain."""
    return event_json.decode("utf-8", "backslashreplace").replace("\0", "\\u0000")
