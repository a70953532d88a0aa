"""Records of mcap files (https://mcap.dev/spec): their positions, and the contents that cxbridge reads.

A file is a sequence of records. A chunk is a record with the records of messages, schemas and channels.
Lengths in a file may be damaged: each is checked before memory is allocated.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from typing import IO, Final

from msgspec import Struct

from cxbridge.errors import TraceError
from cxbridge.extras import install_command

MAGIC: Final = b"\x89MCAP0\r\n"
"""The first eight bytes of an mcap file, and the last eight bytes of a complete file."""

PROFILE: Final = "cxbridge"
"""The profile in the header of files of cxbridge."""

METADATA_NAME: Final = "cxbridge"
"""The name of metadata records of a run; later records extend earlier records."""

SOURCE_NAME: Final = "cxbridge.source"
"""The name of metadata records of a run's sources."""

# Larger sizes count as damage; chunks of cxbridge have about 256 KiB.
MAX_RECORD_SIZE: Final = 256 * 1024 * 1024
"""The maximum number of bytes of a record, and of an unpacked chunk."""

# Kinds of records.
HEADER: Final = 0x01
FOOTER: Final = 0x02
SCHEMA: Final = 0x03
CHANNEL: Final = 0x04
MESSAGE: Final = 0x05
CHUNK: Final = 0x06
ATTACHMENT: Final = 0x09
ATTACHMENT_INDEX: Final = 0x0A
METADATA: Final = 0x0C
METADATA_INDEX: Final = 0x0D

HEAD: Final = struct.Struct("<BQ")
"""The start of every record: its kind and the length of its content."""

_CRC: Final = struct.Struct("<I")
_MAX_NAMES_SIZE: Final = 64 * 1024  # the fields of an attachment before its data fit into these bytes


class DamageError(ValueError):
    """The file is truncated or has invalid content."""


class Record(Struct, frozen=True):
    """The position of a record in the file.

    :param kind: one of the constants above, or the number of another kind.
    :param start: the offset of its content.
    :param size: the number of bytes of its content.
    :param is_complete: whether the file contains all of the content.
    """

    kind: int
    start: int
    size: int
    is_complete: bool


def walk_records(file: IO[bytes]) -> Iterator[Record]:
    """Yield the records of a file outside of chunks, up to the footer.

    A truncated record is the last. Callers may change the position of the file between two records.

    :raises DamageError: if the file ends without a footer, or a record has the kind 0.
    """
    offset = len(MAGIC)
    while True:
        file.seek(offset)
        head = file.read(HEAD.size)
        if len(head) < HEAD.size:
            raise DamageError("the file ends too early")
        kind, size = HEAD.unpack(head)
        # a file system may fill the end of a file with zeros after a power failure
        if kind == 0:
            raise DamageError("a record has no kind")
        start = offset + HEAD.size
        offset = start + size
        if offset > os.fstat(file.fileno()).st_size:
            yield Record(kind, start, size, is_complete=False)
            raise DamageError("the file ends too early")
        yield Record(kind, start, size, is_complete=True)
        if kind == FOOTER:
            return


def read_content(file: IO[bytes], record: Record) -> bytes:
    """Return the content of a record.

    :raises DamageError: if the record is too large, or truncated.
    """
    if record.size > MAX_RECORD_SIZE:
        raise DamageError("a record is too large")
    file.seek(record.start)
    data = file.read(record.size)
    if len(data) < record.size:
        raise DamageError("the file ends too early")
    return data


class FieldReader:
    """Reads the fields of a record in order.

    The methods raise :class:`DamageError` if the record is too short, or a text is invalid.

    :param data: the content of the record, or its start.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.offset = 0
        """The offset of the next field."""

    def read_uint16(self) -> int:
        """Return a 16-bit number."""
        return int.from_bytes(self._next_bytes(2), "little")

    def read_uint32(self) -> int:
        """Return a 32-bit number."""
        return int.from_bytes(self._next_bytes(4), "little")

    def read_uint64(self) -> int:
        """Return a 64-bit number."""
        return int.from_bytes(self._next_bytes(8), "little")

    def read_text(self) -> str:
        """Return a text; its length in bytes precedes it in the file."""
        try:
            return self._next_bytes(self.read_uint32()).decode()
        except UnicodeDecodeError as error:
            raise DamageError("a text is not UTF-8") from error

    def read_map(self) -> dict[str, str]:
        """Return a map of texts."""
        end = self.read_uint32() + self.offset
        values = {}
        while self.offset < end:
            key = self.read_text()
            values[key] = self.read_text()
        return values

    def _next_bytes(self, size: int) -> bytes:
        end = self.offset + size
        if end > len(self._data):
            raise DamageError("a record ends too early")
        piece = self._data[self.offset : end]
        self.offset = end
        return piece


class StoredAttachment(Struct, frozen=True):
    """An attachment without its bytes.

    :param time_ns: in nanoseconds since the epoch.
    :param start: the offset of its bytes in the file.
    :param size: the number of its bytes.
    """

    name: str
    media_type: str
    time_ns: int
    start: int
    size: int


def read_attachment_head(file: IO[bytes], record: Record) -> StoredAttachment:
    """Return the description of an attachment.

    :raises DamageError: if a field is invalid, or the sizes of attachment and record differ.
    """
    file.seek(record.start)
    fields = FieldReader(file.read(min(record.size, _MAX_NAMES_SIZE)))
    log_time_ns, _creation_time_ns = fields.read_uint64(), fields.read_uint64()
    name, media_type, size = fields.read_text(), fields.read_text(), fields.read_uint64()
    start = record.start + fields.offset
    if start + size + _CRC.size != record.start + record.size:
        raise DamageError("the size of an attachment differs from the stated size")
    return StoredAttachment(name, media_type, log_time_ns, start, size)


def read_attachment_data(file: IO[bytes], attachment: StoredAttachment, record: Record) -> bytes:
    """Return the bytes of an attachment.

    :raises DamageError: if the record is too large or truncated, or the checksum is wrong.
    """
    data = read_content(file, record)
    (crc,) = _CRC.unpack_from(data, record.size - _CRC.size)
    if crc not in (0, zlib.crc32(data[: -_CRC.size])):  # mcap: 0 stands for no checksum
        raise DamageError("an attachment has a wrong checksum")
    return data[attachment.start - record.start : -_CRC.size]


def unpack_chunk(data: bytes, *, is_complete: bool) -> bytes:
    """Return the records within a chunk.

    :param is_complete: whether the data are complete; of an incomplete chunk, the existing part is returned.
    :raises DamageError: if the chunk is damaged or too large, or has an unknown compression.
    :raises TraceError: if the chunk is compressed, and the packages for its compression are absent.
    """
    fields = FieldReader(data)
    fields.read_uint64(), fields.read_uint64()  # the times of the first and last message
    size, crc, compression, _ = (
        fields.read_uint64(),
        fields.read_uint32(),
        fields.read_text(),
        fields.read_uint64(),
    )
    if size > MAX_RECORD_SIZE:
        raise DamageError("a chunk is too large")
    packed_records = data[fields.offset :]
    if not is_complete:
        # without its end, a compressed chunk cannot be unpacked
        return b"" if compression else packed_records
    records = _decompress(compression, packed_records, size)
    if len(records) != size or (crc and crc != zlib.crc32(records)):  # mcap: 0 stands for no checksum
        raise DamageError("a chunk has a wrong checksum")
    return records


def _decompress(compression: str, data: bytes, size: int) -> bytes:
    if not compression:
        return data
    if compression not in ("lz4", "zstd"):
        raise DamageError(f"a chunk has the unknown compression {compression!r}")
    try:
        import lz4.frame  # noqa: PLC0415 - an extra: only other programs write packed files
        import zstandard  # noqa: PLC0415 - as above
    except ModuleNotFoundError:
        raise TraceError(
            f"the recording is packed with {compression}", hint=f"to read it: {install_command('packed')}"
        ) from None
    # one byte more than the stated size reveals a wrong size without unpacking everything
    try:
        if compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))
        with zstandard.ZstdDecompressor().stream_reader(data) as reader:
            return reader.read(size + 1)
    except (RuntimeError, EOFError, zstandard.ZstdError) as error:
        raise DamageError(f"a chunk cannot be unpacked: {error}") from error
