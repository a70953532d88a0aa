"""Repairs mcap files: what is whole of a file that was cut off or damaged, with the index that it lacks."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from cxbridge.errors import TraceError
from cxbridge.resources import VERSION
from cxbridge.trace.formats.files import reading
from cxbridge.trace.formats.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    FOOTER,
    HEAD,
    HEADER,
    MAGIC,
    MAX_RECORD,
    MESSAGE,
    METADATA,
    SCHEMA,
    DamageError,
    Record,
    chunk_records,
    content,
    walk,
)

if TYPE_CHECKING:
    from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
    from mcap.writer import Writer


def examine_mcap(path: Path) -> tuple[list[str], Callable[[Path], None]]:
    """Return what is wrong with an mcap file of anybody, and what writes its whole parts to another file.

    :raises TraceError: when nothing of it can be read.
    """
    records = _Records(path)
    if not sum(1 for _ in records):
        raise TraceError("damaged or cut off before the first record", file=path)
    return records.problems, lambda target: _copy(path, target)


class _Records:
    """The records of a file, those of its chunks among them, as far as they are whole.

    After the iteration :attr:`problems` says what is wrong.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.problems: list[str] = []

    def __iter__(self) -> Iterator[Any]:
        """Yield the records that a writer does not make by itself."""
        left_out = 0
        ended = False
        with reading(self._path), self._path.open("rb") as file:
            try:
                for record in walk(file):
                    try:
                        yield from _parsed(_parts(file, record))
                    except DamageError:
                        left_out += 1
                    if record.kind == FOOTER and record.whole:
                        file.seek(record.start + record.size)
                        ended = file.read(len(MAGIC)) == MAGIC
            except DamageError:
                ended = False
        if left_out:
            self.problems.append(f"FIXING: {left_out} damaged records, left out")
        if not ended:
            self.problems.append(
                "FIXING: file without its end, keeping what is whole, writing summary and footer"
            )


def _parts(file: IO[bytes], record: Record) -> Iterator[tuple[int, bytes]]:
    """Yield a record, or those within a chunk; of a chunk that was cut off those that are there."""
    if record.kind != CHUNK:
        if record.whole:
            yield record.kind, content(file, record)
        return
    file.seek(record.start)
    data = chunk_records(file.read(min(record.size, MAX_RECORD)), whole=record.whole)
    at = 0
    while at + HEAD.size <= len(data):
        kind, size = HEAD.unpack_from(data, at)
        at += HEAD.size
        if at + size <= len(data):
            yield kind, data[at : at + size]
        at += size


def _parsed(records: Iterator[tuple[int, bytes]]) -> Iterator[Any]:
    """Yield records as the library knows them.

    :raises DamageError: when one makes no sense.
    """
    from mcap import records as kinds  # noqa: PLC0415 - costs time, only needed here
    from mcap.data_stream import ReadDataStream  # noqa: PLC0415 - costs time, only needed here
    from mcap.exceptions import McapError  # noqa: PLC0415 - costs time, only needed here

    readers: dict[int, Callable[[Any], Any]] = {
        HEADER: kinds.Header.read,
        SCHEMA: kinds.Schema.read,
        CHANNEL: kinds.Channel.read,
        METADATA: kinds.Metadata.read,
        ATTACHMENT: kinds.Attachment.read,
    }
    for kind, data in records:
        stream = ReadDataStream(BytesIO(data))
        try:
            if kind == MESSAGE:
                yield kinds.Message.read(stream, len(data))
            elif kind in readers:
                yield readers[kind](stream)
        except (McapError, struct.error, ValueError, OverflowError) as error:
            raise DamageError("a record is not valid") from error


def _copy(source: Path, target: Path) -> None:
    """Write what is whole of ``source`` to ``target``, with summary and footer."""
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415 - costs time, only needed here

    with target.open("wb") as file:
        copier = _Copier(Writer(file, compression=CompressionType.NONE))
        for record in _Records(source):
            copier.copy(record)
        copier.finish()


class _Copier:
    """Writes records again, with the numbers that the writer gives to schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}
        self._started = False

    def copy(self, record: Any) -> None:
        """Write a record."""
        writers: dict[str, Callable[[Any], None]] = {
            "Header": self._header,
            "Schema": self._schema,
            "Channel": self._channel,
            "Message": self._message,
            "Metadata": self._metadata,
            "Attachment": self._attachment,
        }
        name = type(record).__name__
        if name != "Header":
            self._start("")
        writers[name](record)

    def finish(self) -> None:
        """Write the summary and the footer."""
        self._start("")
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _header(self, record: Header) -> None:
        self._start(record.profile)

    def _start(self, profile: str) -> None:
        if not self._started:
            self._writer.start(profile=profile, library=f"cxbridge {VERSION}")
            self._started = True

    def _schema(self, record: Schema) -> None:
        if record.id not in self._schemas:
            number = self._writer.register_schema(record.name, record.encoding, record.data)
            self._schemas[record.id] = number

    def _channel(self, record: Channel) -> None:
        if record.id not in self._channels and record.schema_id in self._schemas:
            self._channels[record.id] = self._writer.register_channel(
                record.topic, record.message_encoding, self._schemas[record.schema_id], record.metadata
            )

    def _message(self, record: Message) -> None:
        channel = self._channels.get(record.channel_id)
        if channel is not None:
            self._writer.add_message(
                channel, record.log_time, record.data, record.publish_time, record.sequence
            )

    def _metadata(self, record: Metadata) -> None:
        self._writer.add_metadata(record.name, record.metadata)

    def _attachment(self, record: Attachment) -> None:
        self._writer.add_attachment(
            record.create_time, record.log_time, record.name, record.media_type, record.data
        )
