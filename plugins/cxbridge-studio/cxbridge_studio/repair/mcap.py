"""Repair of truncated or damaged mcap files: copies the intact records and writes a new index.

Records are copied, not events, so that also records of later versions stay.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from cxbridge.errors import TraceError
from cxbridge.resources import VERSION
from cxbridge.trace.formats.files import reading
from cxbridge.trace.formats.mcap.file import McapFile
from cxbridge.trace.formats.mcap.records import (
    CHUNK,
    FOOTER,
    HEAD,
    HEADER,
    MAGIC,
    MAX_RECORD,
    DamageError,
    Fields,
    Record,
    chunk_records,
    content,
    walk,
)


def examine_mcap(path: Path) -> tuple[list[str], Callable[[Path], None]]:
    """Return the damage of an mcap file, and a function that writes its intact parts to another file.

    :raises TraceError: if nothing can be read.
    """
    # a dry run: the copy tells the damage
    with open(os.devnull, "wb") as null_device:  # noqa: PTH123 - no path of a file
        problems = _copy(path, null_device)

    def write(target: Path) -> None:
        with target.open("wb") as file:
            _copy(path, file)

    return problems, write


def _copy(source: Path, target: IO[bytes]) -> list[str]:
    """Write the intact records of ``source`` to ``target``, with summary and footer; return the damage."""
    left_out = 0
    ended = False
    copy: McapFile | None = None
    with reading(source), source.open("rb") as file:
        try:
            for record in walk(file):
                try:
                    for kind, data in _records_of(file, record):
                        # the first record has the profile, which the header of the copy repeats
                        if copy is None:
                            profile = Fields(data).text() if kind == HEADER else ""
                            copy = McapFile(target, profile, f"cxbridge {VERSION}")
                        copy.copy_record(kind, data)
                except DamageError:
                    left_out += 1
                if record.kind == FOOTER and record.is_complete:
                    file.seek(record.start + record.size)
                    ended = file.read(len(MAGIC)) == MAGIC
        except DamageError:
            ended = False
    if copy is None:
        raise TraceError("damaged or cut off before the first record", file=source)
    copy.finish()
    problems = [f"FIXING: {left_out} damaged records, left out"] if left_out else []
    if not ended:
        problems.append("FIXING: file without its end, keeping what is whole, writing summary and footer")
    return problems


def _records_of(file: IO[bytes], record: Record) -> Iterator[tuple[int, bytes]]:
    """Yield a record, or those within a chunk; of a truncated chunk its complete records."""
    if record.kind != CHUNK:
        if record.is_complete:
            yield record.kind, content(file, record)
        return
    file.seek(record.start)
    data = chunk_records(file.read(min(record.size, MAX_RECORD)), is_complete=record.is_complete)
    offset = 0
    while offset + HEAD.size <= len(data):
        kind, size = HEAD.unpack_from(data, offset)
        offset += HEAD.size
        if offset + size <= len(data):
            yield kind, data[offset : offset + size]
        offset += size
