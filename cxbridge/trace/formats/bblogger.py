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
from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema
from cxbridge.trace.formats.base import Run

MAGIC = b"\xff\xbb\xff\xbb\x00\x00\x00\x01"
"""Magic number and version, the first eight bytes of a file."""

ENV = "executive"
"""The environment that the states of skillers are said to be read by; the file does not tell."""

_HEADER = "II32s48s64s16sIqq"
_HEADER_SIZE = len(MAGIC) + struct.calcsize(f"<{_HEADER}")
_STAMP_SIZE = 8
_SKILLER = "SkillerInterface"


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
                    yield from _events(header, time_us, memoryview(entry)[_STAMP_SIZE:])
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
        schema = default_registry().schema(_text(kind))
        if size == schema.datasize:
            uid = f"{_text(kind)}::{_text(interface_id)}"
            return Header(order, count, _text(scenario), uid, schema, seconds * MICROSECONDS + microseconds)
    raise TraceError(
        f"its entries of {_text(kind)} have not the {schema.datasize} bytes that our definition has",
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


def _events(header: Header, time_us: int, block: memoryview) -> Iterator[Event]:
    """Yield the write of one entry, and the state of the skiller if it is one's."""
    values = {field.name: _value(field, header, block) for field in header.schema.fields}
    yield InterfaceWrite(time_us, header.uid, values)
    if header.schema.name == _SKILLER:
        skiller = header.uid.partition("::")[2]
        skill, msgid, status = (values.get(name) for name in ("skill_string", "msgid", "status"))
        yield SkillStatus(time_us, ENV, skiller, str(skill), int(msgid or 0), str(status))


def _value(field: FieldSchema, header: Header, block: memoryview) -> Any:
    """Return the value of a field: a text, a number, the name of an enum's item, or a list."""
    if field.type == "string":
        return _text(bytes(block[field.offset : field.offset + field.size]))
    code = f"{header.order}{field.length or 1}{field.storage.code}"
    values: list[Any] = list(struct.unpack_from(code, block, field.offset))
    if field.is_enum:
        names = _item_names(header.schema, field.type)
        values = [names.get(value, value) for value in values]
    return values[0] if field.length is None else values


def _item_names(schema: InterfaceSchema, enum: str) -> dict[int, str]:
    """Return the names of an enum's items by their values."""
    return {item.value: item.name for each in schema.enums if each.name == enum for item in each.items}


def _text(data: bytes) -> str:
    """Return a text that is padded with zeros."""
    return data.split(b"\0", 1)[0].decode("utf-8", "backslashreplace")
