"""Writer of runs as mcap (https://mcap.dev/spec) with JSON messages; see docs/formats.md.

Chunks are not compressed, which keeps recording cheap; ``mcap compress`` compresses a finished file.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, SourceRead
from cxbridge.file_access import make_parent_folder
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.resources import VERSION
from cxbridge.trace.codec import dump_json, encode, event_json_schema
from cxbridge.trace.formats.base import Attachment, RecordingInfo, RunWriter
from cxbridge.trace.formats.files import open_exclusively, writing
from cxbridge.trace.formats.mcap.file import McapFileWriter
from cxbridge.trace.formats.mcap.records import METADATA_NAME, PROFILE, SOURCE_NAME
from cxbridge.trace.source_records import SourceRecordMaker, read_interface_source

_FLUSH_INTERVAL_S = 0.5  # in real time: a killed run loses little
_MAX_PENDING_EVENTS = 512  # writing many events in a row costs a third of writing single events


class McapWriter(RunWriter):
    """An mcap file.

    A write flushes the file if the last flush was more than half a second of real time ago, so that a killed
    run loses few events.

    :param path: replaced if it exists, unless another process writes the file.
    :param definition: returns the definition of an interface type, which is attached before the first event
        of the type, or None for no attachment; gets the type and the time in microseconds.
    :param files: whether to attach the run's sources, including the definitions.
    :raises TraceError: if the file cannot be created, or another process writes the file.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        definition: Callable[[str, int], SourceRead | None] = lambda _type, _time_us: None,
        files: bool = True,
    ) -> None:
        self.path = Path(path)
        self._find_definition = definition
        self._attaches_sources = files
        self._record_maker = SourceRecordMaker()
        self._defined_types: set[str] = set()
        self._pending: list[Event] = []
        self._channels: dict[tuple[type[Event], str], int] = {}  # by type of event and end of the topic
        self._schemas: dict[type[Event], int] = {}
        with writing(self.path):
            self._file = open_exclusively(self.path)
        self._last_flush_s = time.monotonic()
        try:
            with writing(self.path):
                self._mcap = McapFileWriter(self._file, PROFILE, f"cxbridge {VERSION}")
                self._file.flush()
        except TraceError:
            with suppress(OSError):  # closing tries once more to write the data
                self._file.close()
            raise

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        return level.event_types | {SourceRead} if self._attaches_sources else level.event_types

    def write(self, event: Event) -> None:
        """Queue an event for the next write."""
        self._pending.append(event)
        if len(self._pending) >= _MAX_PENDING_EVENTS:
            self._write_pending()
        if time.monotonic() - self._last_flush_s > _FLUSH_INTERVAL_S:
            self.flush()

    def _write_pending(self) -> None:
        """Write the queued events."""
        pending_events, self._pending = self._pending, []
        with writing(self.path):
            self._mcap.add_messages(self._make_messages(pending_events))

    def _make_messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages of channel, time and JSON, and write the run's sources."""
        channels = self._channels
        for event in events:
            event_type = type(event)
            topic_field = event_type.KIND.topic_field
            key = event_type, getattr(event, topic_field) if topic_field else ""
            channel = channels.get(key)
            if channel is None:
                if isinstance(event, SourceRead):
                    self._store_source(event)
                    continue
                if isinstance(event, InterfaceWrite | InterfaceMessage):
                    self._attach_definition(event.uid.partition("::")[0], event.time_us)
                channel = channels[key] = self._add_channel(*key)
            yield channel, event.time_us * 1000, encode(event)

    def describe(self, metadata: Mapping[str, str]) -> None:
        self._write_pending()
        with writing(self.path):
            self._mcap.add_metadata(METADATA_NAME, metadata)
            self._file.flush()

    def attach(self, attachment: Attachment) -> None:
        self._write_pending()
        with writing(self.path):
            self._store_attachment(attachment)

    def _store_attachment(self, attachment: Attachment) -> None:
        self._mcap.add_attachment(
            attachment.time_us * 1000, attachment.name, attachment.media_type, attachment.data
        )

    def _store_source(self, event: SourceRead) -> None:
        """Write the record of a source, and attach the content if it is new."""
        record, attachment = self._record_maker.make_record(event)
        if attachment is not None:
            self._store_attachment(attachment)
        self._mcap.add_metadata(SOURCE_NAME, record)

    def _attach_definition(self, interface_type: str, time_us: int) -> None:
        """Attach the definition of an interface type once."""
        if interface_type and interface_type not in self._defined_types and self._attaches_sources:
            self._defined_types.add(interface_type)
            source = self._find_definition(interface_type, time_us)
            if source is not None:
                self._store_source(source)

    def flush(self) -> None:
        """Complete the chunk and write it to the file."""
        self._last_flush_s = time.monotonic()
        self._write_pending()
        with writing(self.path):
            self._mcap.finish_chunk()
            self._file.flush()

    def close(self) -> None:
        """Write the index and close the file."""
        if self._file.closed:
            return
        try:
            self._write_pending()
            with writing(self.path):
                self._mcap.finish()
        finally:
            with writing(self.path):
                self._file.close()

    def _add_channel(self, event_type: type[Event], topic_suffix: str) -> int:
        """Add the channel of a kind of event, with its schema.

        :param topic_suffix: the value with which the topic ends, such as the uid of an interface.
        """
        schema = self._schemas.get(event_type)
        if schema is None:
            schema = self._mcap.add_schema(
                f"cxbridge.{event_type.__name__}",
                "jsonschema",
                dump_json(event_json_schema(event_type)).encode(),
            )
            self._schemas[event_type] = schema
        return self._mcap.add_channel(
            event_type.KIND.topic + topic_suffix.replace("::", "/", 1), "json", schema
        )


def open_recording(path: Path, recording_info: RecordingInfo) -> McapWriter:
    """Open a recording of a run, with the definitions of its interfaces."""
    return McapWriter(
        make_parent_folder(path),
        definition=partial(read_interface_source, recording_info.registry),
        files=recording_info.has_files,
    )


def open_copy(path: Path, _registry: InterfaceRegistry) -> McapWriter:
    """Open a file for a copy of a run."""
    return McapWriter(path)
