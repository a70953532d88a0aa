"""Headers, entries and names of bblogger files, as written by Fawkes since 2015-03.

The byte order flag and the count are often wrong, see docs/formats.md, so readers do not rely on them.
"""

from __future__ import annotations

import re
import struct
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

from cxbridge.clock import MICROSECONDS, split_us
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.block_decoder import decode_padded_text

MAGIC: Final = b"\xff\xbb\xff\xbb"
"""The first bytes of all files."""

VERSION: Final = b"\x00\x00\x00\x01"
"""The version of the file format."""

ENTRY_HEADER: Final = struct.Struct("<II")
"""The start of an entry: seconds and microseconds from the start of the logger to the logging."""

MAX_BLOCK_SIZE: Final = 1 << 24
"""The maximal plausible size of a block in bytes: eight times the default size of Fawkes' blackboard."""

FLAG_OFFSET: Final = len(MAGIC + VERSION)
"""The offset of the byte order flag, whose lowest bit means big endian."""

COUNT_OFFSET: Final = FLAG_OFFSET + 4
"""The offset of the number of entries."""

_TYPE_NAME = re.compile(rb"[A-Za-z_]\w*")
_SCENARIO_SIZE: Final = 32  # fixed sizes of Fawkes' C struct, in bytes
_TYPE_SIZE: Final = 48
_ID_SIZE: Final = 64
# byte order flag, number of entries, scenario, type, id, hash, block size, start (seconds, microseconds)
_FIELDS: Final = struct.Struct(f"<II{_SCENARIO_SIZE}s{_TYPE_SIZE}s{_ID_SIZE}s16sIqq")
_UINT32_MASK: Final = 0xFFFFFFFF

HEADER_SIZE: Final = FLAG_OFFSET + _FIELDS.size
"""The number of bytes before the first entry."""


@dataclass(frozen=True)
class Header:
    """The header of a bblogger file.

    :param flag: the first byte of the byte order flag.
    :param count: the stated number of entries, 0 for unknown.
    :param interface_type: the name of the type.
    :param hash: the hash of the type, 16 bytes.
    :param data_size: the number of bytes of a block.
    :param start_us: the start of the logger in microseconds since the epoch.
    :param schema: the definition of the type; None if no definition fits the blocks.
    :param problem: the reason for a missing or doubtful schema; otherwise empty.
    """

    flag: int
    count: int
    scenario: str
    interface_type: str
    interface_id: str
    hash: bytes
    data_size: int
    start_us: int
    schema: InterfaceSchema | None
    problem: str

    @property
    def uid(self) -> str:
        """The uid, ``Type::id``."""
        return f"{self.interface_type}::{self.interface_id}"

    @property
    def entry_size(self) -> int:
        """The number of bytes of an entry."""
        return ENTRY_HEADER.size + self.data_size

    @property
    def says_big_endian(self) -> bool:
        """Whether the flag states big endian.

        Since 2018, Fawkes sets the flag on every machine, although the data are little endian.
        """
        return bool(self.flag & 0x01)


def is_bblogger_start(head: bytes) -> bool:
    """Return whether a file with these first bytes is a bblogger file."""
    return head.startswith(MAGIC + VERSION)


def log_files(folder: Path) -> list[Path]:
    """Return the bblogger files in a folder, by name; empty if there is no folder."""
    return [path for path in sorted(folder.glob("*.log")) if folder.is_dir() and _is_log_file(path)]


def _is_log_file(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return is_bblogger_start(file.read(HEADER_SIZE))
    except OSError:
        return False  # a folder, or an unreadable file, which is not part of the recording


def read_header(head: bytes, path: Path, registry: InterfaceRegistry) -> Header:
    """Parse the header of a file.

    :param head: the first :data:`HEADER_SIZE` bytes of the file; all bytes of a shorter file.
    :raises TraceError: if the header is truncated or invalid.
    """
    if len(head) < HEADER_SIZE:
        raise TraceError("cut off within the header", file=path)
    _, count, scenario_field, type_field, id_field, hash_, size, seconds, microseconds = _FIELDS.unpack_from(
        head, FLAG_OFFSET
    )
    if not _TYPE_NAME.fullmatch(type_field.split(b"\0", 1)[0]) or not 0 < size <= MAX_BLOCK_SIZE:
        raise TraceError(
            "the header is not valid for a bblogger file",
            file=path,
            hint="the file is damaged, or from a Fawkes before 2015-03 or a big-endian machine",
        )
    scenario, interface_type, interface_id = map(decode_padded_text, (scenario_field, type_field, id_field))
    start_us = seconds * MICROSECONDS + microseconds
    schema, problem = _find_schema(interface_type, hash_, size, registry)
    return Header(
        head[FLAG_OFFSET],
        count,
        scenario,
        interface_type,
        interface_id,
        hash_,
        size,
        start_us,
        schema,
        problem,
    )


def _find_schema(
    interface_type: str, hash_: bytes, data_size: int, registry: InterfaceRegistry
) -> tuple[InterfaceSchema | None, str]:
    """Return the definition of a type, and its problem; see :class:`Header`."""
    consequence = "; values are left as bytes (other definitions: --interface-dir)"
    try:
        schema = registry.schema(interface_type)
    except InterfaceError as error:
        return None, error.message.split(". ")[0] + consequence  # the rest lists folders of definitions
    if data_size != schema.datasize:
        return None, (
            f"the blocks of {interface_type} have {data_size} bytes, but {schema.datasize} by the definition:"
            f" another version of the interface{consequence}"
        )
    if accepts_hash(schema, hash_):
        return schema, ""
    return schema, f"written with another version of {interface_type} of the same size: values may be wrong"


def pack_header(
    scenario: str, uid: str, hash_: bytes, data_size: int, *, start_us: int, count: int = 0
) -> bytes:
    """Return the bytes of a header.

    :param scenario: a name, cut to 31 bytes.
    :param uid: ``Type::id``, cut to 47 and 63 bytes.
    :param hash_: the hash of the interface type, 16 bytes.
    :param data_size: the number of bytes of a block.
    :param start_us: the reference of the entries' times, in microseconds since the epoch.
    :param count: the number of entries, 0 for unknown.
    """
    interface_type, _, interface_id = uid.partition("::")
    fields = _FIELDS.pack(
        0,  # the byte order flag: little endian
        count,
        _pack_text(scenario, _SCENARIO_SIZE),
        _pack_text(interface_type, _TYPE_SIZE),
        _pack_text(interface_id, _ID_SIZE),
        hash_,
        data_size,
        *split_us(start_us),
    )
    return MAGIC + VERSION + fields


def pack_count(count: int) -> bytes:
    """Return the bytes at :data:`COUNT_OFFSET`. The count has 32 bits and wraps, as in ffbblog."""
    return (count & _UINT32_MASK).to_bytes(4, "little")


def pack_entry(since_us: int, block: bytes) -> bytes:
    """Return an entry with a block that was written ``since_us`` microseconds after the start."""
    seconds, microseconds = split_us(since_us)
    seconds &= _UINT32_MASK  # as in Fawkes' assignment in C: a virtual clock may advance by centuries
    return ENTRY_HEADER.pack(seconds, microseconds) + block


def file_name(scenario: str, uid: str, start_us: int, *, utc: bool = False) -> str:
    """Return Fawkes' name for a file: ``<scenario>-<Type>-<ID>-YYYY-MM-DD-HH-MM-SS.log``.

    In scenario and id, bytes other than ASCII letters, digits and ``-._~`` become ``%XX``.

    :param uid: ``Type::id``.
    :param utc: whether the date is in UTC; otherwise in the time zone of the machine, as in Fawkes.
    """
    interface_type, _, interface_id = uid.partition("::")
    seconds, _ = split_us(start_us)
    date = time.strftime("%Y-%m-%d-%H-%M-%S", time.gmtime(seconds) if utc else time.localtime(seconds))
    return f"{_quote_name(scenario)}-{interface_type}-{_quote_name(interface_id)}-{date}.log"


def _quote_name(text: str) -> str:
    """Return a text for a file name, without slashes, blanks, quotes and characters of patterns."""
    # a text from CLIPS may have a lone surrogate, which is no UTF-8
    return quote(text, safe="", errors="backslashreplace")


def _pack_text(text: str, size: int) -> bytes:
    """Return a text for a field of ``size`` bytes, cut between characters and with room for a final zero."""
    return text.encode("utf-8", "backslashreplace")[: size - 1].decode("utf-8", "ignore").encode()
