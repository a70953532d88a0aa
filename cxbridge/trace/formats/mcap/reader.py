"""Reader of the mcap files that cxbridge records; see docs/formats.md."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from struct import Struct
from typing import IO, Final

from cxbridge.errors import TraceError
from cxbridge.event_kinds import EVENT_TYPES, Event
from cxbridge.trace.codec import EventFormatError, make_decoder
from cxbridge.trace.formats.base import Run, StoredFile
from cxbridge.trace.formats.files import reading
from cxbridge.trace.formats.mcap import records as mcap
from cxbridge.trace.formats.mcap.records import (
    METADATA_NAME,
    PROFILE,
    SOURCE_NAME,
    DamageError,
    FieldReader,
    Record,
)

# The start of a message: its kind, its size, its channel.
_MESSAGE_START: Final = Struct("<BQH")
# Channel, sequence and two times precede the data of a message.
_MESSAGE_FIELDS_SIZE: Final = 22


class McapRun(Run):
    """A run in an mcap file; a truncated or damaged file is read up to the damage."""

    format = "mcap"

    def __iter__(self) -> Iterator[Event]:
        """Yield the events in the order of the file."""
        return self.select(*EVENT_TYPES.values())

    def select(self, *types: type[Event]) -> Iterator[Event]:
        """Yield the events of some types in the order of the file, without decoding other events.

        :raises TraceError: if the file cannot be read, is not a recording of cxbridge, has an invalid event,
            or is damaged before its first event.
        """
        channels = _ChannelDecoders(types)
        unpack, head_size = _MESSAGE_START.unpack_from, _MESSAGE_START.size
        has_messages = False
        with self._opened_file() as file, self._translating_event_errors(), self._noting_damage():
            for block in self._message_blocks(file):
                offset, end = 0, len(block)
                while offset + head_size <= end:
                    # the head includes the channel: messages of other types are skipped at once
                    kind, size, channel = unpack(block, offset)
                    start = offset + mcap.HEAD.size
                    offset = start + size
                    if offset > end:
                        break  # the last record of a truncated chunk is incomplete
                    if kind == mcap.MESSAGE:
                        has_messages = True
                        decode = channels.decoders.get(channel)
                        if decode is not None:
                            yield decode(block[start + _MESSAGE_FIELDS_SIZE : offset])
                    elif kind in (mcap.SCHEMA, mcap.CHANNEL):
                        channels.add_definition(kind, block[start:offset])
                    else:
                        break  # zeros, or a kind that must not be in a chunk
        if self.notes and not has_messages:
            raise TraceError(
                "damaged or cut off before the first event",
                file=self.path,
                hint="the file has no readable event: copy it again, or record again",
            )

    def metadata(self) -> Mapping[str, str]:
        """Return the values of the metadata records; later records replace values of earlier records."""
        values: dict[str, str] = {}
        for record in self._metadata_records(METADATA_NAME):
            values.update(record)
        return values

    def source_records(self) -> Iterator[Mapping[str, str]]:
        return self._metadata_records(SOURCE_NAME)

    def files(self) -> Iterator[StoredFile]:
        """Yield the attached files."""
        with self._opened_file() as file:
            for record in self._readable_records(file, mcap.ATTACHMENT):
                with self._noting_damage():
                    attachment = mcap.read_attachment_head(file, record)
                    yield StoredFile(
                        attachment.name,
                        attachment.media_type,
                        attachment.size,
                        attachment.time_ns // 1000,
                        partial(self._read_attachment, record, attachment),
                    )

    def _read_attachment(self, record: Record, attachment: mcap.StoredAttachment) -> bytes:
        """Return the bytes of an attachment.

        :raises TraceError: if the attachment is damaged.
        """
        with self._opened_file() as file:
            try:
                return mcap.read_attachment_data(file, attachment, record)
            except DamageError as error:
                raise TraceError(
                    f"the attachment {attachment.name} is damaged: {error}", file=self.path
                ) from error

    def _metadata_records(self, name: str) -> Iterator[dict[str, str]]:
        with self._opened_file() as file:
            for record in self._readable_records(file, mcap.METADATA):
                with self._noting_damage():
                    fields = FieldReader(mcap.read_content(file, record))
                    if fields.read_text() == name:
                        yield fields.read_map()

    @contextmanager
    def _translating_event_errors(self) -> Iterator[None]:
        """Raise `TraceError` for messages that are not events."""
        try:
            yield
        except EventFormatError as error:
            raise TraceError(
                f"the file has a message that is {error}",
                file=self.path,
                hint="was the file written by another version of cxbridge?",
            ) from error

    def _message_blocks(self, file: IO[bytes]) -> Iterator[bytes]:
        """Yield the content of each chunk, and each record with a definition or message outside of chunks."""
        for record in self._readable_records(file, mcap.CHUNK, mcap.SCHEMA, mcap.CHANNEL, mcap.MESSAGE):
            try:
                if record.kind == mcap.CHUNK:
                    yield mcap.unpack_chunk(
                        _read_available_content(file, record), is_complete=record.is_complete
                    )
                else:
                    yield mcap.HEAD.pack(record.kind, record.size) + mcap.read_content(file, record)
            except DamageError as error:
                self._note_damage(error)
                return

    def _readable_records(self, file: IO[bytes], *kinds: int) -> Iterator[Record]:
        """Yield the complete records of some kinds, and a truncated chunk, whose start is readable."""
        is_first = True
        with self._noting_damage():
            for record in mcap.walk_records(file):
                if is_first:
                    self._check_header(file, record)
                    is_first = False
                if record.kind in kinds and (record.is_complete or record.kind == mcap.CHUNK):
                    yield record

    def _check_header(self, file: IO[bytes], record: Record) -> None:
        """Check that the first record of the file is the header of a run.

        :raises DamageError: if the record is not a header.
        :raises TraceError: if the file has another profile than the recordings of cxbridge.
        """
        if record.kind != mcap.HEADER:
            raise DamageError("the file does not begin with a header")
        if record.is_complete and FieldReader(mcap.read_content(file, record)).read_text() != PROFILE:
            raise TraceError("the mcap file is not a run recorded by cxbridge", file=self.path)

    @contextmanager
    def _opened_file(self) -> Iterator[IO[bytes]]:
        """Open the file; an error of the operating system becomes a :class:`TraceError`."""
        with reading(self.path), self.path.open("rb") as file:
            yield file

    @contextmanager
    def _noting_damage(self) -> Iterator[None]:
        """Turn damage into a note for the user."""
        try:
            yield
        except DamageError as error:
            self._note_damage(error)

    def _note_damage(self, error: DamageError) -> None:
        self.note(f"damaged or cut off: {error}; read up to there")


class _ChannelDecoders:
    """The decoders of the messages by channel, for the requested types of events."""

    def __init__(self, event_types: Iterable[type[Event]]) -> None:
        self._types_by_schema_name = {
            f"cxbridge.{event_type.__name__}": event_type
            for event_type in event_types
            if event_type.KIND.name  # events without a name are not recorded
        }
        self.decoders: dict[int, Callable[[bytes], Event]] = {}
        self._decoders_by_schema: dict[int, Callable[[bytes], Event]] = {}

    def add_definition(self, kind: int, data: bytes) -> None:
        """Add the decoder of a schema or a channel if it belongs to a requested type.

        :param kind: ``SCHEMA`` or ``CHANNEL``.
        :param data: the content of the record.
        """
        fields = FieldReader(data)
        definition_id = fields.read_uint16()
        if kind == mcap.SCHEMA:
            event_type = self._types_by_schema_name.get(fields.read_text())
            # each chunk may repeat schemas and channels
            if event_type is not None and definition_id not in self._decoders_by_schema:
                self._decoders_by_schema[definition_id] = make_decoder(event_type)
        else:
            decode = self._decoders_by_schema.get(fields.read_uint16())
            if decode is not None:
                self.decoders[definition_id] = decode


def _read_available_content(file: IO[bytes], record: Record) -> bytes:
    """Return the content of a record, or the existing part of a truncated record."""
    if record.is_complete:
        return mcap.read_content(file, record)
    file.seek(record.start)
    return file.read(mcap.MAX_RECORD_SIZE)
