"""Writer of mcap files (https://mcap.dev/spec): records, uncompressed chunks, indexes, summary.

The format's library is slower (docs/evidence/dependencies.md) and takes 50 ms to import. The tests read the
files with the library.
"""

from __future__ import annotations

import struct
import sys
import zlib
from array import array
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import IO, Final

from cxbridge.trace.formats.mcap import records as mcap

CHUNK_SIZE: Final = 256 * 1024
"""The size in bytes at which a chunk is completed; a flush completes smaller chunks. Chosen freely."""

# Kinds of records (https://mcap.dev/spec) that only the writer needs.
_MESSAGE_INDEX: Final = 0x07
_CHUNK_INDEX: Final = 0x08
_STATISTICS: Final = 0x0B
_SUMMARY_OFFSET: Final = 0x0E
_DATA_END: Final = 0x0F

# The start of a message up to its data: its record's head, channel, sequence, log time, publish time.
_MESSAGE: Final = struct.Struct("<BQHIQQ")
_MESSAGE_FIELDS_SIZE: Final = _MESSAGE.size - mcap.HEAD.size
_MAX_TIME_NS: Final = (1 << 64) - 1  # mcap times are unsigned 64-bit integers

_LENGTH: Final = struct.Struct("<I")


def _pack_block(data: bytes) -> bytes:
    """Return data with their length in front, the form of texts and maps in mcap."""
    return _LENGTH.pack(len(data)) + data


def _pack_text(text: str) -> bytes:
    return _pack_block(text.encode("utf-8", "backslashreplace"))


# The names of metadata and their keys repeat.
_pack_name = lru_cache(maxsize=256)(_pack_text)


def _pack_map(values: Mapping[str, str]) -> bytes:
    return _pack_block(b"".join([_pack_name(key) + _pack_text(value) for key, value in values.items()]))


def pack_record(kind: int, *parts: bytes) -> bytes:
    """Return a record: the head with its kind and length, and the joined parts of its content."""
    content = b"".join(parts)
    return mcap.HEAD.pack(kind, len(content)) + content


class McapFileWriter:
    """An mcap file that is being written; errors are those of the operating system.

    A subclass may write records of another file, with the numbers of schemas and channels in that file.

    :param file: positioned at its start.
    :param profile: the name of the conventions that the file follows, for readers.
    :param library: the name of the writing program.
    """

    def __init__(self, file: IO[bytes], profile: str, library: str) -> None:
        self._file = file
        self._offset = 0
        self._schemas: dict[int, bytes] = {0: b""}  # mcap: the number 0 stands for no schema
        self._channels: dict[int, bytes] = {}
        self._chunk = bytearray()
        # the messages of the chunk by channel: times and offsets alternate
        self._message_index: dict[int, list[int]] = {}
        self._first_time_ns, self._last_time_ns = _MAX_TIME_NS, 0
        self._message_counts: dict[int, int] = {}
        self._chunk_index: list[bytes] = []
        self._attachment_index: list[bytes] = []
        self._metadata_index: list[bytes] = []
        self._append(mcap.MAGIC, pack_record(mcap.HEADER, _pack_text(profile), _pack_text(library)))

    def _append(self, *pieces: bytes | bytearray) -> int:
        """Write data to the file; return their offset."""
        offset = self._offset
        for piece in pieces:
            self._file.write(piece)
            self._offset += len(piece)
        return offset

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Write a schema; return its number."""
        number = len(self._schemas)
        content = struct.pack("<H", number), _pack_text(name), _pack_text(encoding), _pack_block(data)
        self._define_schema(number, pack_record(mcap.SCHEMA, *content))
        return number

    def add_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Write a channel; return its number."""
        number = len(self._channels) + 1
        content = struct.pack("<HH", number, schema), _pack_text(topic), _pack_text(encoding), _pack_map({})
        self._define_channel(number, pack_record(mcap.CHANNEL, *content))
        return number

    def _define_schema(self, number: int, record: bytes) -> None:
        """Write the record of a schema, and keep the record for the summary."""
        self._schemas[number] = record
        self._chunk += record

    def _define_channel(self, number: int, record: bytes) -> None:
        """Write the record of a channel, and keep the record for the summary."""
        self._channels[number] = record
        self._chunk += record
        self._message_index[number] = []
        self._message_counts[number] = 0

    def add_messages(self, messages: Iterable[tuple[int, int, bytes]]) -> None:
        """Write messages, each with channel, time and data.

        :param messages: the iterator may add channels. Times are in nanoseconds since the epoch and are
            limited to the range of mcap.
        """
        pack, chunk, indexes = _MESSAGE.pack, self._chunk, self._message_index
        for channel, time_ns, data in messages:
            # struct refuses a time outside of this range, which a robot's wrong clock may yield
            if not 0 <= time_ns <= _MAX_TIME_NS:
                time_ns = max(0, min(time_ns, _MAX_TIME_NS))  # noqa: PLW2901 - the nearest permitted time
            index = indexes[channel]
            index += (time_ns, len(chunk))
            # mcap: the sequence number 0 stands for none
            chunk += pack(mcap.MESSAGE, _MESSAGE_FIELDS_SIZE + len(data), channel, 0, time_ns, time_ns)
            chunk += data
            if len(chunk) >= CHUNK_SIZE:
                self.finish_chunk()
                chunk = self._chunk

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        self._append_indexed(
            pack_record(mcap.METADATA, _pack_name(name), _pack_map(values)),
            self._metadata_index,
            mcap.METADATA_INDEX,
            _pack_name(name),
        )

    def add_attachment(self, time_ns: int, name: str, media_type: str, data: bytes) -> None:
        times, names = struct.pack("<QQ", time_ns, time_ns), _pack_text(name) + _pack_text(media_type)
        content = b"".join((times, names, struct.pack("<Q", len(data)), data))
        self._append_indexed(
            pack_record(mcap.ATTACHMENT, content, struct.pack("<I", zlib.crc32(content))),
            self._attachment_index,
            mcap.ATTACHMENT_INDEX,
            times,
            struct.pack("<Q", len(data)),
            names,
        )

    def _append_indexed(self, record: bytes, index: list[bytes], kind: int, *fields: bytes) -> None:
        """Write a record, and append an index record with the position of the record to ``index``.

        :param kind: the kind of the index record.
        :param fields: the fields of the index record after the position of the record.
        """
        index.append(pack_record(kind, struct.pack("<QQ", self._append(record), len(record)), *fields))

    def finish_chunk(self) -> None:
        """Write the collected messages to the file as a chunk, with their indexes."""
        chunk = self._chunk
        if not chunk:
            return
        indexes = {channel: index for channel, index in self._message_index.items() if index}
        # in an index, times have the even positions
        times = [time for index in indexes.values() for time in (min(index[::2]), max(index[::2]))]
        start_ns, end_ns = (min(times), max(times)) if times else (0, 0)
        head = struct.pack("<QQQI", start_ns, end_ns, len(chunk), zlib.crc32(chunk))
        head += _pack_text("") + struct.pack("<Q", len(chunk))  # mcap: an empty text for no compression
        size = len(head) + len(chunk)
        self._chunk = bytearray()
        for channel, index in indexes.items():
            self._message_index[channel] = []
            self._message_counts[channel] += len(index) // 2
        if times:
            self._first_time_ns, self._last_time_ns = (
                min(self._first_time_ns, start_ns),
                max(self._last_time_ns, end_ns),
            )
        chunk_offset = self._append(mcap.HEAD.pack(mcap.CHUNK, size), head, chunk)
        index_offset = self._offset
        index_positions = [
            struct.pack(
                "<HQ",
                channel,
                self._append(pack_record(_MESSAGE_INDEX, struct.pack("<H", channel), _pack_pairs(index))),
            )
            for channel, index in indexes.items()
        ]
        self._chunk_index.append(
            pack_record(
                _CHUNK_INDEX,
                struct.pack("<QQQQ", start_ns, end_ns, chunk_offset, mcap.HEAD.size + size),
                _pack_block(b"".join(index_positions)),
                struct.pack("<Q", self._offset - index_offset),
                _pack_text(""),
                struct.pack("<QQ", len(chunk), len(chunk)),
            )
        )

    def finish(self) -> None:
        """Write the last chunk, and the summary with the indexes."""
        self.finish_chunk()
        self._append(pack_record(_DATA_END, struct.pack("<I", 0)))  # mcap: 0 stands for no checksum
        start, summary, offsets = self._offset, bytearray(), bytearray()
        # the order of the groups is free, but readers expect schemas before channels
        for kind, records in (
            (mcap.SCHEMA, [*self._schemas.values()][1:]),  # without the placeholder with the number 0
            (mcap.CHANNEL, [*self._channels.values()]),
            (_STATISTICS, [self._pack_statistics()]),
            (_CHUNK_INDEX, self._chunk_index),
            (mcap.ATTACHMENT_INDEX, self._attachment_index),
            (mcap.METADATA_INDEX, self._metadata_index),
        ):
            if records:
                group = b"".join(records)
                offsets += pack_record(
                    _SUMMARY_OFFSET, struct.pack("<BQQ", kind, start + len(summary), len(group))
                )
                summary += group
        footer = struct.pack("<QQ", start, start + len(summary))
        head = mcap.HEAD.pack(mcap.FOOTER, len(footer) + 4)  # with the checksum
        # mcap: the checksum covers the summary, the offsets of its groups, and the footer up to the checksum
        crc = zlib.crc32(footer, zlib.crc32(head, zlib.crc32(offsets, zlib.crc32(summary))))
        self._append(summary, offsets, head, footer, struct.pack("<I", crc), mcap.MAGIC)

    def _pack_statistics(self) -> bytes:
        message_count = sum(self._message_counts.values())
        counts = [struct.pack("<HQ", channel, count) for channel, count in self._message_counts.items()]
        return pack_record(
            _STATISTICS,
            struct.pack(
                "<QHIIIIQQ",
                message_count,
                len(self._schemas) - 1,
                len(self._channels),
                len(self._attachment_index),
                len(self._metadata_index),
                len(self._chunk_index),
                self._first_time_ns if message_count else 0,
                self._last_time_ns,
            ),
            _pack_block(b"".join(counts)),
        )


def _pack_pairs(index: list[int]) -> bytes:
    """Return times and offsets of messages in the byte order of the file."""
    numbers = array("Q", index)
    if sys.byteorder == "big":
        numbers.byteswap()
    return _pack_block(numbers.tobytes())
