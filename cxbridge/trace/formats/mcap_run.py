"""Reads the runs that cxbridge recorded as mcap; see docs/formats.md."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from cxbridge.errors import TraceError
from cxbridge.events import Event
from cxbridge.trace.codec import KINDS, NAMES, EventFormatError, from_plain
from cxbridge.trace.formats.base import Attachment, Run
from cxbridge.trace.formats.mcap_topics import METADATA, PROFILE

MAGIC = b"\x89MCAP0\r\n"
"""The first eight bytes of an mcap file."""

MAX_RECORD = 256 * 1024 * 1024
"""Largest record, and largest chunk when unpacked, in bytes; anything larger is taken for damage."""

_SCHEMAS = {f"cxbridge.{kind.__name__}": NAMES[kind] for kind in KINDS.values()}


class McapRun(Run):
    """A run in an mcap file. One that was cut off or damaged can be read up to the last whole chunk."""

    format = "mcap"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003 - the content decides
        """Whether the file starts as an mcap file does."""
        return head.startswith(MAGIC)

    def __iter__(self) -> Iterator[Event]:
        """Yield the events in the order of the file."""
        from mcap.records import Channel, Message, Schema  # noqa: PLC0415 - costs time, only needed here

        kinds: dict[int, str] = {}
        channels: dict[int, str] = {}
        count = 0
        for record in self._records():
            if isinstance(record, Message):
                name = channels.get(record.channel_id)
                if name is not None:
                    yield self._event(name, record.data)
                    count += 1
            elif isinstance(record, Schema):
                if record.name in _SCHEMAS:
                    kinds[record.id] = _SCHEMAS[record.name]
            elif isinstance(record, Channel) and record.schema_id in kinds:
                channels[record.id] = kinds[record.schema_id]
        if self.notes and not count:
            raise TraceError("damaged or cut off before the first event", file=self.path)

    def metadata(self) -> Mapping[str, str]:
        """Return what the metadata records say, the later ones over the earlier ones."""
        from mcap.records import Metadata  # noqa: PLC0415 - costs time, only needed here

        found: dict[str, str] = {}
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA:
                found.update(record.metadata)
        return found

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files that were attached."""
        from mcap import records  # noqa: PLC0415 - costs time, only needed here

        for record in self._records():
            if isinstance(record, records.Attachment):
                yield Attachment(record.name, record.media_type, record.data)

    def _event(self, name: str, data: bytes) -> Event:
        """Return the event in a message."""
        try:
            return from_plain(name, json.loads(data))
        except (EventFormatError, ValueError, TypeError, RecursionError) as error:
            raise TraceError(
                f"a message that is no event: {error}",
                file=self.path,
                hint="was the file written by another version of cxbridge?",
            ) from error

    def _records(self) -> Iterator[Any]:
        """Yield the records of the file, those within chunks too, as far as they can be read."""
        from mcap.records import Chunk, Footer, Header  # noqa: PLC0415 - costs time, only needed here
        from mcap.stream_reader import StreamReader, breakup_chunk  # noqa: PLC0415 - costs time

        try:
            file = self.path.open("rb")
        except OSError as error:
            raise TraceError(f"cannot be read: {error.strerror}", file=self.path) from error
        with closing(file):
            records = StreamReader(file, emit_chunks=True, record_size_limit=MAX_RECORD).records
            while True:
                try:
                    record = next(records)
                    found = [record]
                    if isinstance(record, Chunk):
                        if record.uncompressed_size > MAX_RECORD:
                            raise EventFormatError("a chunk that is too large")
                        found = breakup_chunk(record, validate_crc=True)
                except StopIteration:
                    return
                except _damage() as error:
                    self.note(f"damaged or cut off: {_reason(error)}; read up to there")
                    return
                if isinstance(record, Header) and record.profile != PROFILE:
                    raise TraceError("an mcap file, but not a run recorded by cxbridge", file=self.path)
                yield from found
                if isinstance(record, Footer):
                    return


def _damage() -> tuple[type[Exception], ...]:
    """Return what the library raises when a file is damaged."""
    import zstandard  # noqa: PLC0415 - costs time, only needed here
    from mcap.exceptions import McapError  # noqa: PLC0415 - costs time, only needed here

    # lz4's errors are RuntimeErrors
    damage = (McapError, struct.error, ValueError, OverflowError, MemoryError, RuntimeError, OSError)
    return (*damage, zstandard.ZstdError)


def _reason(error: Exception) -> str:
    """Return what is wrong in words: the library's own are empty for a file that ends too early."""
    return str(error) or "the file ends too early"
