"""Reads the files of Fawkes' bblogger: the writes of one interface each; see docs/formats.md.

The logger gets things wrong that a reader must cope with: the flag for the byte order says "big" on every
machine; the count of entries is not updated, or not at the end; the time of an entry is when it got around to
writing it. None of these is believed here: the time of a write is the timestamp within the block.
"""

from __future__ import annotations

import heapq
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.blocks import block_events, padded_text

MAGIC = b"\xff\xbb\xff\xbb\x00\x00\x00\x01"
"""Magic number and version, the first eight bytes of a file."""

_HEADER = "II32s48s64s16sIqq"
_HEADER_SIZE = len(MAGIC) + struct.calcsize(f"<{_HEADER}")
_STAMP_SIZE = 8


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a bblogger file.

    :param order: byte order as :mod:`struct` calls it, found by what makes sense.
    :param count: how many entries the header says there are; 0 for unknown.
    :param start_us: when the logger started, microseconds since the epoch.
    """

    order: str
    count: int
    scenario: str
    uid: str
    schema: InterfaceSchema
    start_us: int


class BBLoggerFile(Run):
    """A file of bblogger: interface writes, and for a SkillerInterface the states of the skiller."""

    format = "bblogger"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003 - the content decides
        """Whether the file starts as the files of bblogger do."""
        return head.startswith(MAGIC)

    def __iter__(self) -> Iterator[Event]:
        """Yield a write for each entry; an entry that is cut off is left out."""
        try:
            with self.path.open("rb") as file:
                header = read_header(file.read(_HEADER_SIZE), self.path)
                size = _STAMP_SIZE + header.schema.datasize
                stamps = struct.Struct(f"{header.order}IIqq")
                count = 0
                while len(entry := file.read(size)) == size:
                    count += 1
                    since, since_us, seconds, microseconds = stamps.unpack_from(entry)
                    time_us = seconds * MICROSECONDS + microseconds
                    if not time_us:  # the writer does not stamp: the logger's own time must do
                        time_us = header.start_us + since * MICROSECONDS + since_us
                    block = memoryview(entry)[_STAMP_SIZE:]
                    yield from block_events(header.schema, header.uid, time_us, block, header.order)
        except OSError as error:
            raise TraceError(f"cannot be read: {error.strerror}", file=self.path) from error
        if entry:
            self.note("the file ends within an entry")
        if header.count not in (0, count):
            self.note(f"the header counts {header.count} entries, the file has {count}")


class BBLoggerFolder(Run):
    """A folder of files of bblogger, their entries in the order of time."""

    format = "bblogger"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003 - the content decides
        """Whether this is a folder with at least one file of bblogger."""
        return path.is_dir() and bool(_files(path))

    def __iter__(self) -> Iterator[Event]:
        """Yield the writes of all interfaces."""
        runs = [BBLoggerFile(path) for path in _files(self.path)]
        yield from heapq.merge(*runs, key=lambda event: event.time_us)
        for run in runs:
            for note in run.notes:
                self.note(f"{run.path.name}: {note}")


def read_header(data: bytes, path: Path) -> Header:
    """Return the header at the start of a file.

    :raises TraceError: when it is cut off, or of an interface with another layout than ours.
    :raises InterfaceError: when the type of the interface is unknown.
    """
    if len(data) < _HEADER_SIZE:
        raise TraceError("cut off within the header", file=path)
    for order in "<>":
        values = struct.unpack_from(f"{order}{_HEADER}", data, len(MAGIC))
        _, count, scenario, kind, interface_id, _, size, seconds, microseconds = values
        schema = default_registry().schema(padded_text(kind))
        if size == schema.datasize:
            uid = f"{padded_text(kind)}::{padded_text(interface_id)}"
            return Header(
                order, count, padded_text(scenario), uid, schema, seconds * MICROSECONDS + microseconds
            )
    raise TraceError(
        f"its entries of {padded_text(kind)} have not the {schema.datasize} bytes that our definition has",
        file=path,
        hint="it was written with another version of the interface",
    )


def _files(folder: Path) -> list[Path]:
    """Return the files of bblogger in a folder, by name."""
    return [path for path in sorted(folder.glob("*.log")) if path.is_file() and _starts_well(path)]


def _starts_well(path: Path) -> bool:
    """Whether a file starts as the files of bblogger do."""
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False
