"""A run in memory: events, metadata and files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, SourceRead
from cxbridge.trace.formats.base import Attachment, Run, RunWriter, StoredFile
from cxbridge.trace.source_records import SourceRecordMaker


class MemoryRun(Run):
    """A run in memory, which readers of recordings can use like a file.

    :param name: the name in titles and messages, where other runs have the name of their file.
    """

    format = "memory"

    def __init__(self, name: str) -> None:
        super().__init__(Path(name))
        self.recorded_events: list[Event] = []
        self.recorded_metadata: dict[str, str] = {}
        self.recorded_sources: list[Mapping[str, str]] = []
        self.recorded_attachments: list[Attachment] = []

    def __iter__(self) -> Iterator[Event]:
        return iter(self.recorded_events)

    def metadata(self) -> Mapping[str, str]:
        return self.recorded_metadata

    def files(self) -> Iterator[StoredFile]:
        for attachment in self.recorded_attachments:
            yield StoredFile(
                attachment.name,
                attachment.media_type,
                len(attachment.data),
                attachment.time_us,
                partial(getattr, attachment, "data"),
            )

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return iter(self.recorded_sources)

    def writer(self) -> RunWriter:
        """Return a writer that adds to this run."""
        return _MemoryWriter(self)


class _MemoryWriter(RunWriter):
    """Adds events, metadata, and sources with their files to a :class:`MemoryRun`."""

    def __init__(self, run: MemoryRun) -> None:
        self._run = run
        self._record_maker = SourceRecordMaker()

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        return level.event_types | {SourceRead}

    def write(self, event: Event) -> None:
        if isinstance(event, SourceRead):
            record, attachment = self._record_maker.make_record(event)
            self._run.recorded_sources.append(record)
            if attachment is not None:
                self._run.recorded_attachments.append(attachment)
        else:
            self._run.recorded_events.append(event)

    def describe(self, metadata: Mapping[str, str]) -> None:
        self._run.recorded_metadata.update(metadata)

    def flush(self) -> None:
        """Do nothing: events are not buffered."""

    def close(self) -> None:
        """Do nothing: the run remains in memory."""
