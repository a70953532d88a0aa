"""Writes a run as mcap (https://mcap.dev/spec): JSON messages, one topic a kind; see docs/formats.md.

Chunks are not compressed: that keeps recording cheap, and ``mcap compress`` does it later when wanted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, SourceRead
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.resources import VERSION
from cxbridge.trace.codec import dump, encode, schema_of
from cxbridge.trace.formats.base import Attachment, RunWriter
from cxbridge.trace.formats.files import open_alone, writing
from cxbridge.trace.formats.mcap.file import McapFile
from cxbridge.trace.formats.mcap.records import METADATA_NAME, PROFILE, SOURCE_NAME
from cxbridge.trace.sourcing import SourceNamer

_FLUSH_SECONDS = 0.5
_MOST_PENDING = 512


class McapWriter(RunWriter):
    """An mcap file.

    Whatever was written more than half a second of real time before the last event is safe in the file: a run
    that is killed can be read up to there.

    :param path: the file; one that is there is replaced.
    :param definition: returns the definition of an interface type, to be attached before its first event.
    :param files: whether to attach the run's sources.
    :raises TraceError: when the file cannot be made.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        definition: Callable[[str, int], SourceRead | None] = lambda _type, _time_us: None,
        files: bool = True,
    ) -> None:
        self.path = Path(path)
        self._definition = definition
        self._files = files
        self._sources = SourceNamer()
        self._types: set[str] = set()
        self._pending: list[Event] = []
        self._channels: dict[tuple[type[Event], str], int] = {}
        self._schemas: dict[type[Event], int] = {}
        with writing(self.path):
            self._file = open_alone(self.path)
        self._flushed = time.monotonic()
        try:
            with writing(self.path):
                self._mcap = McapFile(self._file, PROFILE, f"cxbridge {VERSION}")
                self._file.flush()
        except TraceError:
            with suppress(OSError):  # again, for what could not be written before
                self._file.close()
            raise

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        """Return the types of events of the level, all of them, and the run's sources."""
        return level.event_types | {SourceRead} if self._files else level.event_types

    def write(self, event: Event) -> None:
        """Take one event, to be written with the next ones: many in a row cost a third of single ones."""
        self._pending.append(event)
        if len(self._pending) >= _MOST_PENDING:
            self._write_pending()
        if time.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def _write_pending(self) -> None:
        """Write the events that were taken."""
        pending, self._pending = self._pending, []
        with writing(self.path):
            self._mcap.add_messages(self._messages(pending))

    def _messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages: channel, time and JSON. The run's sources are written on the way."""
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
                    self._define(event.uid.partition("::")[0], event.time_us)
                channel = channels[key] = self._add_channel(*key)
            yield channel, event.time_us * 1000, encode(event)

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self._write_pending()
        with writing(self.path):
            self._mcap.add_metadata(METADATA_NAME, metadata)
            self._file.flush()

    def attach(self, attachment: Attachment) -> None:
        """Write an attachment record."""
        self._write_pending()
        with writing(self.path):
            self._store_attachment(attachment)

    def _store_attachment(self, attachment: Attachment) -> None:
        self._mcap.add_attachment(
            attachment.time_us * 1000, attachment.name, attachment.media_type, attachment.data
        )

    def _store_source(self, event: SourceRead) -> None:
        """Write the record of something that the run is made of, and attach it when it is new."""
        record, attachment = self._sources.record(event)
        if attachment is not None:
            self._store_attachment(attachment)
        self._mcap.add_metadata(SOURCE_NAME, record)

    def _define(self, interface_type: str, time_us: int) -> None:
        """Attach the definition of an interface type, once."""
        if interface_type and interface_type not in self._types and self._files:
            self._types.add(interface_type)
            source = self._definition(interface_type, time_us)
            if source is not None:
                self._store_source(source)

    def flush(self) -> None:
        """Finish the chunk, and bring it into the file."""
        self._flushed = time.monotonic()
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

    def _add_channel(self, event_type: type[Event], about: str) -> int:
        """Register the channel of a kind of event, and its schema.

        :param about: the value of the field that its topic ends with.
        """
        schema = self._schemas.get(event_type)
        if schema is None:
            data = dump(schema_of(event_type)).encode()
            schema = self._mcap.add_schema(f"cxbridge.{event_type.__name__}", "jsonschema", data)
            self._schemas[event_type] = schema
        topic = event_type.KIND.topic + about.replace("::", "/", 1)
        return self._mcap.add_channel(topic, "json", schema)


def open_copy(path: Path, _registry: InterfaceRegistry) -> McapWriter:
    """Open a file for a copy of a run."""
    return McapWriter(path)
