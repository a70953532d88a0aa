"""Reader of the files of Fawkes' bblogger; each has the writes of one interface. See docs/formats.md.

The reader does not rely on three values of the files. The flag for the byte order means "big" on every
machine, and is ignored. The number of entries is not updated, or not at the end: a wrong number causes a
note, unless it is 0. The time of an entry is that of logging: it counts only if the block lacks a valid time
stamp of the write.
"""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from heapq import merge
from pathlib import Path
from typing import Any

from cxbridge.clock import MICROSECONDS, format_asctime
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event
from cxbridge.interfaces.layout import TIMESTAMP_SIZE
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.block_decoder import BlockDecoder, write_events
from cxbridge.trace.formats.files import reading
from cxbridge_fawkes.bblogger.header import (
    COUNT_OFFSET,
    ENTRY_HEADER,
    FLAG_OFFSET,
    HEADER_SIZE,
    Header,
    log_files,
    pack_count,
    read_header,
)

RAW_FIELD = "block"
"""The only field of a write of an unknown interface: its block as hexadecimal digits, without time stamp."""

# the time stamp at the start of a block: seconds and microseconds
_STAMP = struct.Struct("<qq")
_MAX_READ_SIZE = 1 << 18  # in bytes; chosen freely: large enough for few reads of small entries
_MAX_US = (1 << 63) // 1000  # in nanoseconds, times fit a signed integer of 64 bits, and thus mcap files


class BBLoggerFile(Run):
    """A bblogger file: interface writes, and the states of a Skiller for a SkillerInterface."""

    format = "bblogger"

    @cached_property
    def header(self) -> Header:
        """The header of the file.

        :raises TraceError: if the header cannot be read.
        """
        return self._read_header_and_size()[0]

    def _read_header_and_size(self) -> tuple[Header, int]:
        with reading(self.path), self.path.open("rb") as file:
            size = self.path.stat().st_size
            return read_header(file.read(HEADER_SIZE), self.path, self.registry), size

    def entries(self) -> Iterator[tuple[int, memoryview]]:
        """Yield the entries: microseconds from the start of the logger to the logging, and the block.

        A truncated entry is left out with a note.

        :raises TraceError: if the file cannot be read.
        """
        header = self.header
        entry_size = header.entry_size
        unpack_time = ENTRY_HEADER.unpack_from
        count = partial_size = 0
        with reading(self.path), self.path.open("rb") as file:
            file.seek(HEADER_SIZE)
            # each read has whole entries, so that no entry must be joined from two reads
            while chunk := file.read(max(_MAX_READ_SIZE // entry_size, 1) * entry_size):
                view = memoryview(chunk)
                partial_size = len(chunk) % entry_size
                for offset in range(0, len(chunk) - partial_size, entry_size):
                    seconds, microseconds = unpack_time(chunk, offset)
                    since_us = seconds * MICROSECONDS + microseconds
                    yield since_us, view[offset + ENTRY_HEADER.size : offset + entry_size]
                count += len(chunk) // entry_size
        if partial_size:
            self.note("the file ends within an entry")
        if header.count not in (0, count):
            self.note(f"the header counts {header.count} entries, the file has {count}")

    def __iter__(self) -> Iterator[Event]:
        header = self.header
        if header.problem:
            self.note(header.problem)
        unpack_stamp = _STAMP.unpack_from
        has_stamp = header.data_size >= TIMESTAMP_SIZE
        decode = _read_raw_block if header.schema is None else BlockDecoder(header.schema).decode
        uid, interface_type, start_us = header.uid, header.interface_type, header.start_us
        for since_us, block in self.entries():
            time_us = 0
            if has_stamp:
                seconds, microseconds = unpack_stamp(block)
                time_us = seconds * MICROSECONDS + microseconds
            # without a valid time stamp of the writer, the logger's time counts
            if not 0 < time_us < _MAX_US:
                time_us = max(0, min(start_us + since_us, _MAX_US))
            yield from write_events(interface_type, uid, time_us, decode(block))

    def metadata(self) -> Mapping[str, str]:
        """Return scenario, interface and start from the header."""
        header = self.header
        return {
            "scenario": header.scenario,
            "interface": header.uid,
            "interface hash": header.hash.hex().upper(),
            "start time": format_asctime(header.start_us),
        }

    def find_repairs(self) -> tuple[list[str], Callable[[Path], object]]:
        """Return the repairs of byte order flag, end and count, and a function that writes the repaired file.

        The texts of the repairs are those of ``ffbblog repair``, mistakes in spelling included.
        """
        header, size = self._read_header_and_size()
        repair_texts, patches = [], []
        if header.says_big_endian:
            repair_texts.append("FIXING: header says big endian, but the data are little endian, setting")
            patches.append((FLAG_OFFSET, bytes([header.flag ^ 0x01])))
        count, extra_size = divmod(size - HEADER_SIZE, header.entry_size)
        if extra_size:
            repair_texts.append(f"FIXING: errorneous bytes at end of file, truncating by {extra_size} b")
        if header.count != count:
            repair_texts.append(
                f"FIXING: header has {header.count} data items, but expecting {count}, setting"
                if header.count
                else f"FIXING: header of file {self.path} has 0 data items, setting to {count}."
            )
            patches.append((COUNT_OFFSET, pack_count(count)))
        return repair_texts, partial(_copy_patched_start, self.path, size - extra_size, patches)

    def description(self) -> Iterator[str]:
        """Yield the lines of ``ffbblog info``, with a note on a wrong byte order."""
        header, size = self._read_header_and_size()
        endian = "Big" if header.says_big_endian else "Little"
        yield f"File version: {1:<10d}  Endianess: {endian} Endian"
        yield f"# data items: {header.count:<10d}  Data size: {header.data_size} bytes"
        yield f"Header size:  {HEADER_SIZE} bytes   File size: {size} bytes"
        yield ""
        yield f"Scenario:   {header.scenario}"
        yield f"Interface:  {header.uid} ({header.hash.hex().upper()})"
        yield f"Start time: {format_asctime(header.start_us)}"
        if header.says_big_endian:
            yield "            (but the data are little endian; 'trace repair' mends the header)"


def _read_raw_block(block: memoryview) -> dict[str, Any]:
    return {RAW_FIELD: block[TIMESTAMP_SIZE:].hex()}


def _copy_patched_start(source: Path, size: int, patches: Sequence[tuple[int, bytes]], target: Path) -> None:
    """Copy the start of a file.

    :param size: the number of bytes to copy.
    :param patches: offsets with the bytes that replace those of the source.
    """
    shutil.copyfile(source, target)
    with target.open("r+b") as file:
        file.truncate(size)
        for offset, new_bytes in patches:
            file.seek(offset)
            file.write(new_bytes)


class BBLoggerFolder(Run):
    """A folder of bblogger files, merged by time; a file with an invalid header is left out with a note."""

    format = "bblogger"

    def __iter__(self) -> Iterator[Event]:
        runs = self.file_runs()
        # at equal times, the events of the file with the first name are first
        yield from merge(*runs, key=lambda event: event.time_us)
        for run in runs:
            for note in run.notes:
                self.note(f"{run.path.name}: {note}")

    def file_runs(self) -> list[BBLoggerFile]:
        """Return the files with a readable header, by name; empty if the folder has no bblogger files.

        :raises TraceError: if the folder has bblogger files, but none of them has a readable header.
        """
        runs = []
        first_error: CxbridgeError | None = None
        for path in log_files(self.path):
            run = BBLoggerFile(path, self.registry)
            try:
                run.header  # noqa: B018 - raises the error about an unreadable header
            except TraceError as error:
                first_error = first_error or error
                self.note(f"{path.name}: left out: {error.message}")
            else:
                runs.append(run)
        if first_error is not None and not runs:
            raise first_error
        starts = {(run.header.scenario, run.header.start_us) for run in runs}
        if len(starts) > 1:
            self.note(f"files of {len(starts)} runs, by their scenarios and starts")
        return runs

    def description(self) -> Iterator[str]:
        """Yield the output of ``ffbblog info`` for each file."""
        for run in self.file_runs():
            yield f"{run.path.name}:"
            yield from (f"  {line}".rstrip() for line in run.description())
