"""Reads the files of Fawkes' bblogger: the writes of one interface each; see docs/formats.md.

The logger gets things wrong that a reader must cope with: the flag for the byte order says "big" on every
machine; the count of entries is not updated, or not at the end; the time of an entry is when it got around to
writing it. None of these is believed here: the time of a write is the timestamp within the block.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event, InterfaceWrite
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import FolderRun, Run
from cxbridge.trace.formats.bblogger.header import (
    ENTRY_HEADER_SIZE,
    HEADER_SIZE,
    Header,
    log_files,
    read_header,
)
from cxbridge.trace.formats.blocks import STAMP_SIZE, BlockDecoder, write_events
from cxbridge.trace.formats.files import reading

RAW = "block"
"""The one field of a write whose interface is not known: its block in hexadecimal digits, without stamp."""

_ENTRY = struct.Struct("<II")
_STAMP = struct.Struct("<qq")
_READ_SIZE = 1 << 18
_MAX_US = (1 << 63) // 1000  # what mcap can hold, which counts nanoseconds
_ASCTIME_FROM_S = 1_000_000_000


class Entry(NamedTuple):
    """An entry of a file.

    :param since_us: microseconds from the start of the logger until it wrote the entry.
    :param block: the bytes of the interface.
    """

    since_us: int
    block: memoryview


class BBLoggerFile(Run):
    """A file of bblogger: interface writes, and for a SkillerInterface the states of the skiller.

    A definition of the interface that is in the same folder goes before those of the registry.
    """

    format = "bblogger"

    @cached_property
    def header(self) -> Header:
        """The header of the file.

        :raises TraceError: when it cannot be read.
        """
        return self._open()[0]

    def _open(self) -> tuple[Header, int]:
        """Return the header, and how many bytes the file has."""
        with reading(self.path), self.path.open("rb") as file:
            size = self.path.stat().st_size
            return read_header(file.read(HEADER_SIZE), self.path, self._definitions), size

    @cached_property
    def _definitions(self) -> InterfaceRegistry:
        if next(self.path.parent.glob("*Interface.xml"), None) is None:
            return self.registry
        return InterfaceRegistry([self.path.parent, *self.registry.dirs], shipped=False)

    def entries(self) -> Iterator[Entry]:
        """Yield the entries; one that is cut off is left out, and noted.

        :raises TraceError: when the file cannot be read.
        """
        header = self.header
        size = header.entry_size
        stamp = _ENTRY.unpack_from
        count = rest = 0
        with reading(self.path), self.path.open("rb") as file:
            file.seek(HEADER_SIZE)
            while data := file.read(max(_READ_SIZE // size, 1) * size):
                view = memoryview(data)
                rest = len(data) % size
                for at in range(0, len(data) - rest, size):
                    seconds, microseconds = stamp(data, at)
                    since_us = seconds * MICROSECONDS + microseconds
                    yield Entry(since_us, view[at + ENTRY_HEADER_SIZE : at + size])
                count += len(data) // size
        if rest:
            self.note("the file ends within an entry")
        if header.count not in (0, count):
            self.note(f"the header counts {header.count} entries, the file has {count}")

    def __iter__(self) -> Iterator[Event]:
        """Yield a write for each entry."""
        header = self.header
        if header.problem:
            self.note(header.problem)
        stamp = _STAMP.unpack_from
        stamped = header.data_size >= STAMP_SIZE
        values = self._values()
        uid, kind, start_us = header.uid, header.kind, header.start_us
        states = header.schema is not None and kind == "SkillerInterface"
        for since_us, block in self.entries():
            time_us = 0
            if stamped:
                seconds, microseconds = stamp(block)
                time_us = seconds * MICROSECONDS + microseconds
            if (
                not 0 < time_us < _MAX_US
            ):  # the writer does not stamp, or wrongly: the logger's own time must do
                time_us = max(0, min(start_us + since_us, _MAX_US))
            if states:
                yield from write_events(kind, uid, time_us, values(block))
            else:
                yield InterfaceWrite(time_us, uid, values(block))

    def _values(self) -> Any:
        """Return what makes the values of a block."""
        header = self.header
        if header.schema is not None:
            return BlockDecoder(header.schema).values
        return lambda block: {RAW: block[STAMP_SIZE:].hex()}

    def metadata(self) -> Mapping[str, str]:
        """Return scenario, interface and start as the header has them."""
        header = self.header
        return {
            "scenario": header.scenario,
            "interface": header.uid,
            "interface hash": header.hash.hex().upper(),
            "start time": start_text(header.start_us),
        }

    def description(self) -> Iterator[str]:
        """Yield the lines of ``ffbblog info``, and a note on a wrong header."""
        header, size = self._open()
        endian = "Big" if header.says_big_endian else "Little"
        yield f"File version: {1:<10d}  Endianess: {endian} Endian"
        yield f"# data items: {header.count:<10d}  Data size: {header.data_size} bytes"
        yield f"Header size:  {HEADER_SIZE} bytes   File size: {size} bytes"
        yield ""
        yield f"Scenario:   {header.scenario}"
        yield f"Interface:  {header.uid} ({header.hash.hex().upper()})"
        yield f"Start time: {start_text(header.start_us)}"
        if header.says_big_endian:
            yield "            (but the data are little endian; 'trace repair' mends the header)"


class BBLoggerFolder(FolderRun):
    """A folder of files of bblogger, their entries by time. Unreadable files are left out, and noted."""

    format = "bblogger"

    def runs(self) -> list[BBLoggerFile]:
        """Return the files that can be read, by name.

        :raises TraceError: when there is none.
        """
        runs = []
        first: CxbridgeError | None = None
        for path in log_files(self.path):
            run = BBLoggerFile(path, self.registry)
            try:
                run.header  # noqa: B018 - whether it can be read
            except TraceError as error:
                first = first or error
                self.note(f"{path.name}: left out: {error.message}")
            else:
                runs.append(run)
        if first is not None and not runs:
            raise first
        starts = {(run.header.scenario, run.header.start_us) for run in runs}
        if len(starts) > 1:
            self.note(f"files of {len(starts)} runs, by their scenarios and starts")
        return runs

    def description(self) -> Iterator[str]:
        """Yield what ``ffbblog info`` prints of each file."""
        for run in self.runs():
            yield f"{run.path.name}:"
            yield from (f"  {line}".rstrip() for line in run.description())


def start_text(time_us: int) -> str:
    """Return a time as Fawkes prints it: in the machine's zone; before 2001-09-09 as two numbers."""
    seconds, microseconds = divmod(time_us, MICROSECONDS)
    if seconds >= _ASCTIME_FROM_S:
        try:
            return time.asctime(time.localtime(seconds))
        except (OverflowError, ValueError, OSError):
            pass
    return f"{seconds}:{microseconds}"
