"""The headers, entries and names of bblogger files, of every age and byte order.

docs/formats.md has the table. Flags and counts of these files are wrong as often as not, so what a file is
follows from what makes sense as a whole: the padding of texts, the sizes of blocks and file, the start.
"""

from __future__ import annotations

import re
import struct
import sys
import time
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final
from urllib.parse import quote

from cxbridge.clock import MICROSECONDS, split_us
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.blocks import packing_of, padded_text
from cxbridge.trace.formats.files import files_starting

MAGIC: Final = b"\xff\xbb\xff\xbb"
"""What files begin with since 2010."""

VERSION: Final = b"\x00\x00\x00\x01"
"""The version of the file, the same ever since."""

ENTRY_HEADER_SIZE: Final = 8
"""Bytes of an entry before its block."""

MAX_BLOCK: Final = 1 << 24
"""Largest block, in bytes, that is believed."""

_TYPE_NAME = re.compile(rb"[A-Za-z_]\w*")
_EARLIEST_S, _LATEST_S = 1_000_000_000, 1 << 33
_FIRST_FLAG = {0x01: "<", 0x80: ">"}


@dataclass(frozen=True)
class HeaderLayout:
    """What is where in a header; the numbers are bytes.

    :param since: year and month that it came with.
    :param stamped: whether all blocks of its time begin with a time stamp.
    """

    since: str
    magic: bytes
    type_size: int
    id_size: int
    stamped: bool

    @cached_property
    def fields(self) -> str:
        """What follows magic and version, as :mod:`struct` spells it, without byte order."""
        return f"II32s{self.type_size}s{self.id_size}s16sIqq"

    @cached_property
    def size(self) -> int:
        """Bytes before the first entry."""
        return self.flag_offset + struct.calcsize(f"<{self.fields}")

    @property
    def flag_offset(self) -> int:
        """Where the byte order flag lies."""
        return len(self.magic)

    @property
    def count_offset(self) -> int:
        """Where the count of the entries lies."""
        return self.flag_offset + 4


_SCENARIO_SIZE: Final = 32
_COUNT: Final = struct.Struct("=I")
_ENTRY: Final = struct.Struct("=II")
_BYTE_ORDER: Final = 0 if sys.byteorder == "little" else 1 << 31  # a bit field, which C begins at byte 0
_UINT32: Final = 0xFFFFFFFF

LAYOUTS: Final = (
    HeaderLayout("2015-03", MAGIC + VERSION, 48, 64, stamped=True),
    HeaderLayout("2015-01", MAGIC + VERSION, 32, 64, stamped=True),
    HeaderLayout("2010-01", MAGIC + VERSION, 32, 32, stamped=False),
    HeaderLayout("2009-11", VERSION, 32, 32, stamped=False),
)
"""All that were ever written, today's first."""

TODAY: Final = LAYOUTS[0]
"""The layout that is written."""

MAX_HEADER: Final = TODAY.size
"""Bytes of the longest header."""


@dataclass(frozen=True)
class Header:
    """The header of a bblogger file.

    :param order: byte order as :mod:`struct` calls it, found by what makes sense.
    :param flag: the first byte of the flag as it is written there.
    :param count: how many entries the header says there are; 0 for unknown.
    :param kind: the type of the interface.
    :param hash: the hash of the type, 16 bytes.
    :param data_size: bytes of a block.
    :param start_us: when the logger started, microseconds since the epoch.
    :param schema: the definition of the type; None when there is none that fits the blocks.
    :param packing: how the fields are in the blocks, see :data:`~cxbridge.trace.formats.blocks.PACKINGS`.
    :param problem: why there is no schema, or what is doubtful about it; empty when nothing is.
    """

    layout: HeaderLayout
    order: str
    flag: int
    count: int
    scenario: str
    kind: str
    interface_id: str
    hash: bytes
    data_size: int
    start_us: int
    schema: InterfaceSchema | None
    packing: int
    problem: str

    @property
    def uid(self) -> str:
        """``Type::id``."""
        return f"{self.kind}::{self.interface_id}"

    @property
    def entry_size(self) -> int:
        """Bytes of an entry."""
        return ENTRY_HEADER_SIZE + self.data_size

    @property
    def says_big_endian(self) -> bool:
        """What the flag says, read by a machine of the file's byte order."""
        return bool(self.flag & (0x01 if self.order == "<" else 0x80))

    @property
    def stamped(self) -> bool:
        """Whether blocks surely begin with a time stamp."""
        return self.schema is not None or self.layout.stamped


def starts_well(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is one of bblogger's."""
    if head.startswith(MAGIC + VERSION):
        return True
    return head.startswith(VERSION) and bool(_candidates(head, None))


def log_files(folder: Path) -> list[Path]:
    """Return the files of bblogger in a folder, by name."""
    return files_starting(folder, "*.log", MAX_HEADER, starts_well)


def read_header(head: bytes, path: Path, registry: InterfaceRegistry, file_size: int | None = None) -> Header:
    """Return the header of a file.

    :param head: the first :data:`MAX_HEADER` bytes of the file, or all that exists.
    :param registry: who knows the types of interfaces.
    :param file_size: bytes of the file, if they are known.
    :raises TraceError: when it is cut off, or makes no sense.
    """
    candidates = _candidates(head, file_size)
    if not candidates:
        if len(head) < MAX_HEADER:
            raise TraceError("cut off within the header", file=path)
        raise TraceError("the header is not valid for a bblogger file", file=path, hint="the file is damaged")
    known = [
        (score + 8 * _fits(header, registry), -i, header) for i, (score, header) in enumerate(candidates)
    ]
    return _with_schema(max(known)[2], registry)


def _candidates(head: bytes, file_size: int | None) -> list[tuple[int, Header]]:
    """Return all that a header can mean, and how much speaks for each, beyond what it must have."""
    found = []
    for strict in (True, False):
        for layout in LAYOUTS:
            if head.startswith(layout.magic) and len(head) >= layout.size:
                found += [
                    (_score(header, file_size), header)
                    for order in "<>"
                    if (header := _parse(head, layout, order, strict=strict)) is not None
                ]
        if found:
            break
    return found


def _parse(head: bytes, layout: HeaderLayout, order: str, *, strict: bool) -> Header | None:
    """Return the header that ``head`` is in this layout and byte order, None when it is none.

    :param strict: texts must be padded with zeros, as the logger does.
    """
    values = struct.unpack_from(f"{order}{layout.fields}", head, layout.flag_offset)
    _, count, scenario, kind, interface_id, version, size, seconds, microseconds = values
    texts = (scenario, kind, interface_id)
    if strict and not all(_padded(text) for text in texts):
        return None
    if not strict and layout is not TODAY:
        return None
    if not _TYPE_NAME.fullmatch(kind.split(b"\0", 1)[0]) or not 0 < size <= MAX_BLOCK:
        return None
    names = (padded_text(scenario), padded_text(kind), padded_text(interface_id))
    start_us = seconds * MICROSECONDS + microseconds
    flag = head[layout.flag_offset]
    return Header(layout, order, flag, count, *names, version, size, start_us, None, 0, "")


def _score(header: Header, file_size: int | None) -> int:
    """Return how much speaks for a header."""
    plausible_start = _EARLIEST_S <= header.start_us // MICROSECONDS < _LATEST_S
    whole = file_size is not None and (file_size - header.layout.size) % header.entry_size == 0
    return 4 * plausible_start + 2 * whole + (_FIRST_FLAG.get(header.flag, "<") == header.order)


def _padded(text: bytes) -> bool:
    """Whether a text ends with a zero, and nothing but zeros comes after it."""
    return not text.split(b"\0", 1)[-1].strip(b"\0") and b"\0" in text


def _fits(header: Header, registry: InterfaceRegistry) -> bool:
    """Whether the definition of the type has blocks of this size."""
    try:
        return packing_of(registry.schema(header.kind), header.data_size) is not None
    except InterfaceError:
        return False


def _with_schema(header: Header, registry: InterfaceRegistry) -> Header:
    """Return the header with the definition of its type, or with the reason why there is none."""
    schema: InterfaceSchema | None = None
    packing = 0
    problem = ""
    try:
        known = registry.schema(header.kind)
    except InterfaceError as error:
        problem = error.message.split(". ")[0]
    else:
        packing = packing_of(known, header.data_size) or 0
        if packing:
            schema = known
        else:
            problem = (
                f"its blocks of {header.kind} have {header.data_size} bytes, those of our definition"
                f" {known.datasize}: another version of the interface"
            )
    if problem:
        problem += "; values are left as bytes (other definitions: --interface-dir)"
    elif schema is not None and not _accepts(schema, header):
        problem = f"written with another version of {header.kind} of the same size: values may be wrong"
    return replace(header, schema=schema, packing=packing, problem=problem)


def _accepts(schema: InterfaceSchema, header: Header) -> bool:
    """Whether the hash in the header stands for this definition; in 2009 it was cut off at a zero byte."""
    if header.layout.magic == VERSION:
        stem = header.hash.split(b"\0", 1)[0]
        return accepts_hash(schema, header.hash) or schema.hash.startswith(stem)
    return accepts_hash(schema, header.hash)


def pack_header(
    scenario: str, uid: str, version: bytes, data_size: int, *, start_us: int, count: int = 0
) -> bytes:
    """Return the header of a file.

    :param scenario: a name; 31 bytes of it are kept.
    :param uid: ``Type::id``; 47 and 63 bytes are kept.
    :param version: the hash of the interface type, 16 bytes.
    :param data_size: bytes of a block.
    :param start_us: what the times of the entries count from, microseconds since the epoch.
    :param count: how many entries follow; 0 for unknown.
    """
    kind, _, interface_id = uid.partition("::")
    texts = _text(scenario, _SCENARIO_SIZE), _text(kind, TODAY.type_size), _text(interface_id, TODAY.id_size)
    fields = _BYTE_ORDER, count, *texts, version, data_size, *split_us(start_us)
    return TODAY.magic + struct.pack(f"={TODAY.fields}", *fields)


def pack_count(count: int) -> bytes:
    """Return what belongs at the ``count_offset`` of :data:`TODAY`."""
    return _COUNT.pack(count)


def pack_entry(since_us: int, block: bytes) -> bytes:
    """Return an entry: a block that was written ``since_us`` microseconds after the start."""
    seconds, microseconds = split_us(since_us)
    seconds &= _UINT32  # as C's assignment does: a virtual clock may leap over centuries
    return _ENTRY.pack(seconds, microseconds) + block


def is_header_of(head: bytes, scenario: str) -> bool:
    """Whether a file that begins with ``head`` is bblogger's and of this scenario."""
    start = TODAY.count_offset + _COUNT.size
    field = head[start : start + _SCENARIO_SIZE]
    return head.startswith(TODAY.magic) and field == _text(scenario, _SCENARIO_SIZE).ljust(
        _SCENARIO_SIZE, b"\0"
    )


def file_name(scenario: str, uid: str, start_us: int, *, utc: bool = False) -> str:
    """Return Fawkes' name for a file: ``<scenario>-<Type>-<ID>-YYYY-MM-DD-HH-MM-SS.log``.

    In scenario and id, a byte that is neither letter nor digit of ASCII nor one of ``-._~`` becomes ``%XX``.

    :param uid: ``Type::id``.
    :param utc: tell the time in UTC; else in the machine's zone, as Fawkes does.
    """
    kind, _, interface_id = uid.partition("::")
    return f"{_quoted(scenario)}-{kind}-{_quoted(interface_id)}-{_date(start_us, utc=utc)}.log"


def file_pattern(scenario: str, start_us: int, *, utc: bool = False) -> str:
    """Return a shell pattern that finds at least the files of this scenario and start."""
    return f"{_quoted(scenario)}-*-{_date(start_us, utc=utc)}.log"


def _quoted(text: str) -> str:
    """Return a text as a part of a file's name, without what a shell or a pattern interprets."""
    return quote(text, safe="", errors="backslashreplace")


def _date(time_us: int, *, utc: bool) -> str:
    """Return a time as it is written in the names of files."""
    second, _ = split_us(time_us)
    return time.strftime("%Y-%m-%d-%H-%M-%S", time.gmtime(second) if utc else time.localtime(second))


def _text(text: str, size: int) -> bytes:
    """Return a text for a field of ``size`` bytes that ends with a zero; no character is cut in two."""
    return text.encode("utf-8", "backslashreplace")[: size - 1].decode("utf-8", "ignore").encode()
