"""The headers, entries and names of bblogger files, as Fawkes writes them since 2015-03.

docs/formats.md has the table. Flag and count are wrong as often as not: neither is believed.
"""

from __future__ import annotations

import re
import struct
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final
from urllib.parse import quote

from cxbridge.clock import MICROSECONDS, split_us
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.blocks import padded_text
from cxbridge.trace.formats.files import files_starting

MAGIC: Final = b"\xff\xbb\xff\xbb"
"""The start of all files."""

VERSION: Final = b"\x00\x00\x00\x01"
"""The version of the file."""

ENTRY_HEADER_SIZE: Final = 8
"""Bytes of an entry before its block."""

MAX_BLOCK: Final = 1 << 24
"""Largest block, in bytes, that is believed."""

FLAG_OFFSET: Final = len(MAGIC + VERSION)
"""Where the byte order flag lies; its lowest bit says "big"."""

COUNT_OFFSET: Final = FLAG_OFFSET + 4
"""Where the count of the entries lies."""

_TYPE_NAME = re.compile(rb"[A-Za-z_]\w*")
_SCENARIO_SIZE: Final = 32
_TYPE_SIZE: Final = 48
_ID_SIZE: Final = 64
_FIELDS: Final = struct.Struct(f"<II{_SCENARIO_SIZE}s{_TYPE_SIZE}s{_ID_SIZE}s16sIqq")
_COUNT: Final = struct.Struct("<I")
_ENTRY: Final = struct.Struct("<II")
_UINT32: Final = 0xFFFFFFFF

HEADER_SIZE: Final = FLAG_OFFSET + _FIELDS.size
"""Bytes before the first entry."""


@dataclass(frozen=True)
class Header:
    """The header of a bblogger file.

    :param flag: the first byte of the flag.
    :param count: how many entries the header says there are; 0 for unknown.
    :param kind: the type of the interface.
    :param hash: the hash of the type, 16 bytes.
    :param data_size: bytes of a block.
    :param start_us: when the logger started, microseconds since the epoch.
    :param schema: the definition of the type; None when there is none that fits the blocks.
    :param problem: the reason for a missing or doubtful schema; empty: none.
    """

    flag: int
    count: int
    scenario: str
    kind: str
    interface_id: str
    hash: bytes
    data_size: int
    start_us: int
    schema: InterfaceSchema | None
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
        """Whether the flag says so, as it does in every file since 2018; all data are little endian."""
        return bool(self.flag & 0x01)


def starts_well(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is one of bblogger's."""
    return head.startswith(MAGIC + VERSION)


def log_files(folder: Path) -> list[Path]:
    """Return the files of bblogger in a folder, by name."""
    return files_starting(folder, "*.log", HEADER_SIZE, starts_well)


def read_header(head: bytes, path: Path, registry: InterfaceRegistry) -> Header:
    """Return the header of a file.

    :param head: the first :data:`HEADER_SIZE` bytes of the file, or all that exists.
    :param registry: who knows the types of interfaces.
    :raises TraceError: when it is cut off, or not valid.
    """
    if len(head) < HEADER_SIZE:
        raise TraceError("cut off within the header", file=path)
    _, count, *texts, version, size, seconds, microseconds = _FIELDS.unpack_from(head, FLAG_OFFSET)
    if not _TYPE_NAME.fullmatch(texts[1].split(b"\0", 1)[0]) or not 0 < size <= MAX_BLOCK:
        raise TraceError(
            "the header is not valid for a bblogger file",
            file=path,
            hint="the file is damaged, of a Fawkes before 2015-03, or of a big-endian machine",
        )
    scenario, kind, interface_id = map(padded_text, texts)
    start_us = seconds * MICROSECONDS + microseconds
    flag = head[FLAG_OFFSET]
    header = Header(flag, count, scenario, kind, interface_id, version, size, start_us, None, "")
    return _with_schema(header, registry)


def _with_schema(header: Header, registry: InterfaceRegistry) -> Header:
    """Return the header with the definition of its type, or with the reason why there is none."""
    schema: InterfaceSchema | None = None
    problem = ""
    try:
        known = registry.schema(header.kind)
    except InterfaceError as error:
        problem = error.message.split(". ")[0]
    else:
        if header.data_size == known.datasize:
            schema = known
        else:
            problem = (
                f"its blocks of {header.kind} have {header.data_size} bytes, those of our definition"
                f" {known.datasize}: another version of the interface"
            )
    if problem:
        problem += "; values are left as bytes (other definitions: --interface-dir)"
    elif schema is not None and not accepts_hash(schema, header.hash):
        problem = f"written with another version of {header.kind} of the same size: values may be wrong"
    return replace(header, schema=schema, problem=problem)


def pack_header(
    scenario: str, uid: str, version: bytes, data_size: int, *, start_us: int, count: int = 0
) -> bytes:
    """Return the header of a file.

    :param scenario: a name; 31 bytes of it are kept.
    :param uid: ``Type::id``; 47 and 63 bytes are kept.
    :param version: the hash of the interface type, 16 bytes.
    :param data_size: bytes of a block.
    :param start_us: the start of the entries' times, microseconds since the epoch.
    :param count: how many entries follow; 0 for unknown.
    """
    kind, _, interface_id = uid.partition("::")
    texts = _text(scenario, _SCENARIO_SIZE), _text(kind, _TYPE_SIZE), _text(interface_id, _ID_SIZE)
    return MAGIC + VERSION + _FIELDS.pack(0, count, *texts, version, data_size, *split_us(start_us))


def pack_count(count: int) -> bytes:
    """Return the bytes at :data:`COUNT_OFFSET`."""
    return _COUNT.pack(count)


def pack_entry(since_us: int, block: bytes) -> bytes:
    """Return an entry: a block that was written ``since_us`` microseconds after the start."""
    seconds, microseconds = split_us(since_us)
    seconds &= _UINT32  # as C's assignment does: a virtual clock may leap over centuries
    return _ENTRY.pack(seconds, microseconds) + block


def is_header_of(head: bytes, scenario: str) -> bool:
    """Whether a file that begins with ``head`` is bblogger's and of this scenario."""
    start = COUNT_OFFSET + _COUNT.size
    field = head[start : start + _SCENARIO_SIZE]
    return starts_well(head) and field == _text(scenario, _SCENARIO_SIZE).ljust(_SCENARIO_SIZE, b"\0")


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
    """Return a text as a part of a file's name, without characters of shells and patterns."""
    return quote(text, safe="", errors="backslashreplace")


def _date(time_us: int, *, utc: bool) -> str:
    """Return a time for the name of a file."""
    second, _ = split_us(time_us)
    return time.strftime("%Y-%m-%d-%H-%M-%S", time.gmtime(second) if utc else time.localtime(second))


def _text(text: str, size: int) -> bytes:
    """Return a text for a field of ``size`` bytes that ends with a zero; no character is cut in two."""
    return text.encode("utf-8", "backslashreplace")[: size - 1].decode("utf-8", "ignore").encode()
