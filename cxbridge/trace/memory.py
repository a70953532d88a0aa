"""A run in memory: events, metadata and files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, SourceRead
from cxbridge.trace.formats.base import Attachment, Run, RunWriter, StoredFile
from cxbridge.trace.sourcing import SourceNamer


class MemoryRun(Run):
    """A run in memory, which readers of recordings can use like a file.

    :param name: used instead of a file name in titles and messages.
    """

    format = "memory"

    def __init__(self, name: str) -> None:
        super().__init__(Path(name))
        self._events: list[Event] = []
        self._metadata: dict[str, str] = {}
        self._sources: list[Mapping[str, str]] = []
        self._attachments: list[Attachment] = []

    def __iter__(self) -> Iterator[Event]:
        return iter(self._events)

    def metadata(self) -> Mapping[str, str]:
        return self._metadata

    def files(self) -> Iterator[StoredFile]:
        for attachment in self._attachments:
            yield StoredFile(
                attachment.name,
                attachment.media_type,
                len(attachment.data),
                attachment.time_us,
                partial(_data, attachment),
            )

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return iter(self._sources)

    def writer(self) -> RunWriter:
        """Return a writer that adds to this run."""
        return _MemoryWriter(self._events, self._metadata, self._sources, self._attachments)


class _MemoryWriter(RunWriter):
    """Appends events and sources to the lists of a :class:`MemoryRun`."""

    def __init__(
        self,
        events: list[Event],
        metadata: dict[str, str],
        sources: list[Mapping[str, str]],
        attachments: list[Attachment],
    ) -> None:
        self._events = events
        self._metadata = metadata
        self._sources = sources
        self._attachments = attachments
        self._namer = SourceNamer()

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        return level.event_types | {SourceRead}

    def write(self, event: Event) -> None:
        """Append an event."""
        if isinstance(event, SourceRead):
            record, attachment = self._namer.record(event)
            self._sources.append(record)
            if attachment is not None:
                self._attachments.append(attachment)
        else:
            self._events.append(event)

    def describe(self, metadata: Mapping[str, str]) -> None:
        self._metadata.update(metadata)

    def flush(self) -> None:
        """Do nothing, because events are not buffered."""

    def close(self) -> None:
        """Do nothing, because the run remains in memory."""


def _data(attachment: Attachment) -> bytes:
    return attachment.data
