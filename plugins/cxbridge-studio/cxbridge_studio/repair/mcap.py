"""Repair of truncated or damaged mcap files: copies the intact records, and writes a new index.

The repair copies records without decoding the events in them: a repaired file keeps the events that only a
later version of cxbridge knows.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from cxbridge.errors import TraceError
from cxbridge.resources import VERSION
from cxbridge.trace.formats.files import reading
from cxbridge.trace.formats.mcap import records as mcap
from cxbridge.trace.formats.mcap.file import CHUNK_SIZE, McapFileWriter, pack_record
from cxbridge.trace.formats.mcap.records import (
    DamageError,
    FieldReader,
    Record,
    read_content,
    unpack_chunk,
    walk_records,
)


class _McapCopy(McapFileWriter):
    """A new mcap file with records of the damaged file."""

    def copy_record(self, kind: int, content: bytes) -> None:
        """Write a schema, a channel, a message, metadata or an attachment.

        Schemas and channels keep their ids, so that the messages still refer to them. A record whose schema
        or channel is missing is left out, and so are repeated schemas and channels, and other kinds of
        records: the copy gets a new header, new indexes and a new summary.

        :raises DamageError: if a field is invalid.
        """
        fields, record = FieldReader(content), pack_record(kind, content)
        match kind:
            case mcap.SCHEMA:
                if (schema_id := fields.read_uint16()) not in self._schemas:
                    self._define_schema(schema_id, record)
            case mcap.CHANNEL:
                channel_id, schema_id = fields.read_uint16(), fields.read_uint16()
                if channel_id not in self._channels and schema_id in self._schemas:
                    self._define_channel(channel_id, record)
            case mcap.MESSAGE:
                channel_id, _, time_ns = fields.read_uint16(), fields.read_uint32(), fields.read_uint64()
                if channel_id in self._message_index:
                    self._message_index[channel_id] += (time_ns, len(self._chunk))
                    self._chunk += record
            case mcap.METADATA:
                fields.read_text()  # the name, which the index repeats
                self._append_indexed(
                    record, self._metadata_index, mcap.METADATA_INDEX, content[: fields.offset]
                )
            case mcap.ATTACHMENT:
                # The index repeats the bytes of these fields, with the size before the names.
                fields.read_uint64(), fields.read_uint64()  # the times of the log and of the creation
                times = content[: fields.offset]
                fields.read_text(), fields.read_text()  # the name and the media type
                names = content[len(times) : fields.offset]
                packed_size = struct.pack("<Q", fields.read_uint64())
                self._append_indexed(
                    record, self._attachment_index, mcap.ATTACHMENT_INDEX, times, packed_size, names
                )
        if len(self._chunk) >= CHUNK_SIZE:
            self.finish_chunk()


def examine_mcap(path: Path) -> tuple[list[str], Callable[[Path], None]]:
    """Return the damage of an mcap file, and a function that writes its intact parts to another file.

    :raises TraceError: if the file cannot be read, or has no intact record.
    """
    # the copy is discarded: only copying all records shows the damage
    with open(os.devnull, "wb") as null_device:  # noqa: PTH123 - os.devnull is a text
        problems = _copy_records(path, null_device)

    def write(target: Path) -> None:
        with target.open("wb") as file:
            _copy_records(path, file)

    return problems, write


def _copy_records(source: Path, target: IO[bytes]) -> list[str]:
    """Write the intact records of ``source`` to ``target``, with summary and footer; return the damage.

    :raises TraceError: if the file cannot be read, or has no intact record.
    """
    damaged_count = 0
    has_end = False
    copy: _McapCopy | None = None
    with reading(source), source.open("rb") as file:
        try:
            for record in walk_records(file):
                try:
                    for kind, content in _unpack_records(file, record):
                        # the first record has the profile, which the header of the copy repeats
                        if copy is None:
                            profile = FieldReader(content).read_text() if kind == mcap.HEADER else ""
                            copy = _McapCopy(target, profile, f"cxbridge {VERSION}")
                        copy.copy_record(kind, content)
                except DamageError:
                    damaged_count += 1
                if record.kind == mcap.FOOTER and record.is_complete:
                    file.seek(record.start + record.size)
                    has_end = file.read(len(mcap.MAGIC)) == mcap.MAGIC
        except DamageError:
            has_end = False
    if copy is None:
        raise TraceError("damaged or cut off before the first record", file=source)
    copy.finish()
    problems = [f"FIXING: {damaged_count} damaged records, left out"] if damaged_count else []
    if not has_end:
        problems.append(
            "FIXING: the end of the file is missing, keeping the complete records, writing summary and footer"
        )
    return problems


def _unpack_records(file: IO[bytes], record: Record) -> Iterator[tuple[int, bytes]]:
    """Yield the kind and the content of a record, or of each complete record in a chunk."""
    if record.kind != mcap.CHUNK:
        if record.is_complete:
            yield record.kind, read_content(file, record)
        return
    file.seek(record.start)
    chunk = unpack_chunk(file.read(min(record.size, mcap.MAX_RECORD_SIZE)), is_complete=record.is_complete)
    offset = 0
    while offset + mcap.HEAD.size <= len(chunk):
        kind, size = mcap.HEAD.unpack_from(chunk, offset)
        offset += mcap.HEAD.size
        if offset + size <= len(chunk):
            yield kind, chunk[offset : offset + size]
        offset += size
