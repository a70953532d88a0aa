"""Mends mcap files: what is whole of a file that was cut off or damaged, with the index that it lacks."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge import __version__
from cxbridge.errors import TraceError
from cxbridge.trace.formats.mcap_run import MAX_RECORD

if TYPE_CHECKING:
    from mcap.records import Attachment, Channel, Message, Metadata, Schema
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
    """The records of a file, as far as they are whole. A chunk that is damaged is left out.

    After the iteration :attr:`problems` tells what is wrong.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.problems: list[str] = []

    def __iter__(self) -> Iterator[Any]:
        from mcap.records import Chunk, Footer  # noqa: PLC0415 - costs time, only needed here
        from mcap.stream_reader import StreamReader, breakup_chunk  # noqa: PLC0415 - costs time

        damage = _damage()
        left_out = 0
        ended = False
        try:
            with self._path.open("rb") as file:
                reader = StreamReader(
                    file, emit_chunks=True, validate_crcs=True, record_size_limit=MAX_RECORD
                )
                records = reader.records
                while True:
                    try:
                        record = next(records)
                    except StopIteration:
                        break
                    except damage:
                        ended = False
                        break
                    ended = isinstance(record, Footer)
                    if not isinstance(record, Chunk):
                        yield record
                        continue
                    try:
                        parts = (
                            breakup_chunk(record, validate_crc=True)
                            if record.uncompressed_size <= MAX_RECORD
                            else None
                        )
                    except damage:
                        parts = None
                    if parts is None:
                        left_out += 1
                    else:
                        yield from parts
        except OSError as error:
            raise TraceError(f"cannot be read: {error.strerror}", file=self._path) from error
        if left_out:
            self.problems.append(f"FIXING: {left_out} damaged chunks, left out")
        if not ended:
            self.problems.append(
                "FIXING: no end of the file, leaving out what is not whole and writing summary and footer"
            )


def _copy(source: Path, target: Path) -> None:
    """Write what is whole of ``source`` to ``target``, with summary and footer."""
    from mcap.records import Header  # noqa: PLC0415 - costs time, only needed here
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415 - costs time

    with target.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        copier: _Copier | None = None
        for record in _Records(source):
            if copier is None:
                profile = record.profile if isinstance(record, Header) else ""
                writer.start(profile=profile, library=f"cxbridge {__version__}")
                copier = _Copier(writer)
            copier.copy(record)
        writer.finish()  # type: ignore[no-untyped-call]


class _Copier:
    """Writes records again, with the numbers that the writer gives to schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}

    def copy(self, record: Any) -> None:
        """Write a record, if it is none that the writer makes by itself."""
        write = getattr(self, f"_{type(record).__name__.lower()}", None)
        if write is not None:
            write(record)

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


def _damage() -> tuple[type[Exception], ...]:
    """Return what the library raises when a file is damaged."""
    import zstandard  # noqa: PLC0415 - costs time, only needed here
    from mcap.exceptions import McapError  # noqa: PLC0415 - costs time, only needed here

    # lz4's errors are RuntimeErrors
    return (
        McapError,
        struct.error,
        ValueError,
        OverflowError,
        MemoryError,
        RuntimeError,
        zstandard.ZstdError,
    )
