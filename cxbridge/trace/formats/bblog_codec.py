"""The bytes and names of bblogger files, as the host's C compiler would lay them out; see docs/formats.md."""

from __future__ import annotations

import struct
import sys
import time
from typing import Final
from urllib.parse import quote

from cxbridge.clock import split_us
from cxbridge.trace.formats.bblog_header import MAGIC, VERSION

_FIXED = struct.Struct("=II32s48s64s16sIQQ")
_ENTRY = struct.Struct("=II")
_COUNT = struct.Struct("=I")

HEADER_SIZE: Final = len(MAGIC + VERSION) + _FIXED.size
"""Bytes before the first entry."""

COUNT_OFFSET: Final = 12
"""Where in the header the count of the entries lies."""

_SCENARIO_OFFSET = 16
_SCENARIO_SIZE, _TYPE_SIZE, _ID_SIZE = 32, 48, 64
_BYTE_ORDER = 0 if sys.byteorder == "little" else 1 << 31  # a bit field, which C begins at the first byte
_UINT32 = 0xFFFFFFFF


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
    return (
        MAGIC
        + VERSION
        + _FIXED.pack(
            _BYTE_ORDER,
            count,
            _text(scenario, _SCENARIO_SIZE),
            _text(kind, _TYPE_SIZE),
            _text(interface_id, _ID_SIZE),
            version,
            data_size,
            *split_us(start_us),
        )
    )


def pack_count(count: int) -> bytes:
    """Return what belongs at :data:`COUNT_OFFSET`."""
    return _COUNT.pack(count)


def pack_entry(since_us: int, block: bytes) -> bytes:
    """Return an entry: a block that was written ``since_us`` microseconds after the start."""
    seconds, microseconds = split_us(since_us)
    seconds &= _UINT32  # as C's assignment does: a virtual clock may leap over centuries
    return _ENTRY.pack(seconds, microseconds) + block


def is_header_of(head: bytes, scenario: str) -> bool:
    """Whether a file that begins with ``head`` is bblogger's and of this scenario."""
    field = head[_SCENARIO_OFFSET : _SCENARIO_OFFSET + _SCENARIO_SIZE]
    return head.startswith(MAGIC + VERSION) and field == _text(scenario, _SCENARIO_SIZE).ljust(
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
    """Return a time as it stands in the names of files."""
    second, _ = split_us(time_us)
    return time.strftime("%Y-%m-%d-%H-%M-%S", time.gmtime(second) if utc else time.localtime(second))


def _text(text: str, size: int) -> bytes:
    """Return a text for a field of ``size`` bytes that ends with a zero; no character is cut in two."""
    return text.encode("utf-8", "backslashreplace")[: size - 1].decode("utf-8", "ignore").encode()
